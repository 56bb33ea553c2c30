#version 300 es
// The shading of render/brdf.h, and the maps and the photograph as they are.
precision highp float;
precision highp int;

uniform sampler2D diffuseMap, specularMap; // sRGB textures: linear here
uniform sampler2D detailMap;               // normal x and y, roughness
uniform sampler2D photoMap;                // sRGB values as stored
uniform vec4 panel;                        // of the canvas: x, y of its lower left corner, width, height
uniform vec3 lightPlace, cameraPlace;      // in sides of the sample, from its centre
uniform float power, ambient;
uniform vec3 guards;                       // least roughness, nz^2, distance^2 (rd_guards in render/brdf.c)
uniform float roughnessFactor, relief;
uniform float split;                       // left of it leftKind, right of it rightKind
uniform int leftKind, rightKind;           // LIT ...
uniform bool sphere, repeats;
uniform float radius;                      // of the sphere
out vec4 colour;

const float PI = 3.14159265358979;
const int LIT = 0, DIFFUSE = 1, SPECULAR = 2, ROUGHNESS = 3, NORMAL = 4;
const vec3 BACKGROUND = vec3(0.11);

vec3 toSrgb(vec3 v)
{
    v = clamp(v, 0.0, 1.0);
    return mix(12.92 * v, 1.055 * pow(v, vec3(1.0 / 2.4)) - 0.055, greaterThan(v, vec3(0.0031308)));
}

// f max(n.l, 0) E + ambient (s + (1 - s) d)
vec3 radiance(vec3 d, vec3 s, float roughness, vec3 n, vec3 point)
{
    vec3 toLight = lightPlace - point, l = normalize(toLight), v = normalize(cameraPlace - point), h = normalize(l + v);
    vec3 around = ambient * (s + (1.0 - s) * d);
    float nl = dot(n, l), nv = dot(n, v), nh = dot(n, h), vh = dot(v, h);
    if (nl <= 0.0 || nv <= 0.0 || vh <= 0.0) return around;
    vec3 across = cross(n, h);
    float alpha = roughness * roughness, k = alpha / 2.0, inner = alpha * alpha * nh * nh + dot(across, across);
    float distribution = alpha * alpha / (PI * inner * inner);
    float visible = 1.0 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
    vec3 fresnel = s + (1.0 - s) * exp2((-5.55473 * vh - 6.98316) * vh);
    vec3 f = (1.0 - s) * d / PI + distribution * visible * fresnel / 4.0;
    return around + f * nl * power / max(dot(toLight, toLight), guards.z);
}

// x, y with the guard of rd_decode; relief scales the slopes.
vec3 decodeNormal(vec2 xy)
{
    float z = sqrt(max(1.0 - dot(xy, xy), guards.y));
    return normalize(vec3(relief * xy, z));
}

vec3 show(int kind, vec2 uv, vec2 flip, vec3 point, mat3 frame)
{
    vec3 detail = texture(detailMap, uv).xyz;
    if (kind == LIT) {
        vec3 n = frame * decodeNormal(clamp(detail.xy, -1.0, 1.0) * flip);
        float roughness = clamp(detail.z * roughnessFactor, guards.x, 1.0);
        return toSrgb(radiance(texture(diffuseMap, uv).rgb, texture(specularMap, uv).rgb, roughness, n, point));
    }
    if (kind == DIFFUSE) return toSrgb(texture(diffuseMap, uv).rgb);
    if (kind == SPECULAR) return toSrgb(texture(specularMap, uv).rgb);
    if (kind == ROUGHNESS) return vec3(detail.z);
    if (kind == NORMAL) return vec3(detail.xy, sqrt(max(1.0 - dot(detail.xy, detail.xy), 0.0))) / 2.0 + 0.5;
    return texture(photoMap, uv).rgb;
}

void main()
{
    vec2 at = (gl_FragCoord.xy - panel.xy) / panel.zw;
    int kind = at.x < split ? leftKind : rightKind;
    vec3 point = vec3(at - 0.5, 0.0);
    vec2 flip = vec2(1.0), on = point.xy;
    mat3 frame = mat3(1.0);
    float cover = 1.0;
    if (sphere) {
        // Seen from afar. A place at angle a from the front has the map's place a radius from its centre.
        float r = length(point.xy) / radius, a = asin(min(r, 1.0)), pixel = 1.0 / (panel.z * radius);
        cover = 1.0 - smoothstep(1.0 - pixel, 1.0 + pixel, r);
        vec2 way = r > 0.0 ? point.xy / (r * radius) : vec2(1.0, 0.0);
        on = way * a * radius;
        vec3 out3 = vec3(way * sin(a), cos(a)), ahead = vec3(way * cos(a), -sin(a)), side = vec3(-way.y, way.x, 0.0);
        frame = mat3(way.x * ahead - way.y * side, way.y * ahead + way.x * side, out3);
        point = out3 * radius;
        // Beyond its edge the map goes on mirrored, where it does not repeat.
        if (!repeats) flip = 1.0 - 2.0 * mod(floor(on + 0.5), 2.0);
    }
    vec3 shown = show(kind, vec2(on.x + 0.5, 0.5 - on.y), flip, point, frame);
    colour = vec4(mix(BACKGROUND, shown, cover), 1.0);
}
