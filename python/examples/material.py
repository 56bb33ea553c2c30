"""From a photograph to maps, step by step: run it whole, or cell by cell where an editor knows "# %%".

    python material.py PHOTO FOLDER
"""

# %% The library
import sys

import numpy as np

import lgd

photo, folder = sys.argv[1:3]
print(f"lgd {lgd.version()}")

# %% Maps of 128 x 128 pixels. The field of view comes from the file, where it has one.
maps = lgd.estimate(photo, size=128, progress=lambda done, rmse: print(f"{100 * done:3.0f}%"))
print(f"field of view {maps.photo.fov:.1f} degrees ({maps.fov_from})")
print(f"difference from the photograph: {maps.rmse[0]:.4f} at first, {maps.rmse[-1]:.4f} at last")

# %% They are numpy arrays, linear, the top row first.
print("mean diffuse albedo:", maps.diffuse.mean((0, 1)).round(3))
print("mean F0:            ", maps.specular.mean((0, 1)).round(3))
print(f"roughness: {maps.roughness.min():.2f} .. {maps.roughness.max():.2f}")
tilt = np.degrees(np.arccos(maps.normal[:, :, 2].clip(0, 1)))
print(f"the surface is tilted by {tilt.mean():.1f} degrees on average")

# %% The same surface, half as rough, under a light from the left.
maps.array[:, :, 5] *= 0.5
image = maps.render(light=(-0.75, 0, 0.75))
print(f"brightest pixel: {image.max():.2f}")

# %% The files of lgd-infer, and one that Blender opens.
maps.save(folder, ["diffuse", "specular", "roughness", "normal", "preview", "glb"])
print(f"{folder} is written")
