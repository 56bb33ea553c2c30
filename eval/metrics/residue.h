/* What can be said of maps whose truth nobody knows. */
#ifndef EV_RESIDUE_H
#define EV_RESIDUE_H

/* What a flash at the centre leaves in maps: how far each map's mean over a disk at the centre is from that over a ring
 * around it (radii EV_DISK, and EV_RING_INNER to EV_RING_OUTER, in patch widths). Of a material that is alike
 * everywhere all are 0. */
#define EV_DISK 0.12
#define EV_RING_INNER 0.3
#define EV_RING_OUTER 0.5
typedef struct ev_residue {
    double diffuse, specular; /* of the mean over the colours of v^(1/2.2) */
    double roughness;
    double hue;    /* of the diffuse's mean v^(1/2.2) divided by the mean of its colours: RMS over the colours */
    double relief; /* not a residue: RMS of n_x and n_y over the patch */
} ev_residue;

/* maps: [size, size, channels]. NaN where the disk or the ring has no pixel. */
ev_residue ev_residue_of(int size, const float *maps, int channels);
#endif
