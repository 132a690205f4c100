// Programs of the graphics card. What they compute is what `phyxel-splat` computes: `carry.rs`,
// `project.rs`, `raster.rs`, `resolve.rs`, `shade.rs`.
import { unit } from "./camera.js";

const HEAD = `#version 300 es
precision highp float;
precision highp int;
precision highp sampler2D;
`;

/** Tangents of a surfel: of the normal alone. */
const TANGENTS = `
vec3 firstTangent(vec3 n) {
  float s = (floatBitsToUint(n.z) >> 31) == 0u ? 1.0 : -1.0;
  float a = -1.0 / (s + n.z);
  return vec3(n.x * n.y * a, s + n.y * n.y * a, -n.y);
}
`;

/** Numbers of a surfel: OWN texels of its own, then one for each of its nodes. */
const RECORD = `
uniform sampler2D records;
/** Of each disk that may be seen: which surfel it is, and its size over the surfel's. */
uniform sampler2D shown;
uniform int stride;
const int PER_ROW = 64;
const int OWN = 4;
vec4 record(int surfel, int k) {
  int each = OWN + stride;
  return texelFetch(records, ivec2((surfel % PER_ROW) * each + k, surfel / PER_ROW), 0);
}
`;

/** A triangle over the whole picture. */
const WHOLE = `${HEAD}
void main() {
  gl_Position = vec4(vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0, 0.0, 1.0);
}`;

/** Carries surfels, each a texel: centre, axes of the disk, normal and its change along them, strain, place of the clip + 1. */
export const CARRY = {
  vertex: WHOLE,
  fragment: `${HEAD}${TANGENTS}${RECORD}
uniform sampler2D nodes;
/** A number of each node, carried instead of the strain where there is one. */
uniform sampler2D values;
uniform bool valued;
uniform float maxStretch;
layout(location = 0) out vec4 out0;
layout(location = 1) out vec4 out1;
layout(location = 2) out vec4 out2;
layout(location = 3) out vec4 out3;
layout(location = 4) out vec4 out4;
vec3 clampLength(vec3 v, float most) {
  float size = length(v);
  return size > most ? v * (most / size) : v;
}
void main() {
  vec2 which = texelFetch(shown, ivec2(gl_FragCoord.xy), 0).xy;
  int i = int(which.x);
  vec4 place = record(i, 0);
  vec3 n = record(i, 1).xyz;
  vec3 shape = record(i, 2).xyz;
  vec4 rest = vec4(place.xyz, 1.0);
  float radius = place.w * which.y;
  vec3 first = vec3(0.0), at = vec3(0.0), driftU = vec3(0.0), driftV = vec3(0.0);
  mat3 rows = mat3(0.0);
  float value = 0.0;
  for (int k = 0; k < stride; k += 1) {
    vec4 link = record(i, OWN + k);
    int j = int(link.x);
    ivec2 from = ivec2(3 * (j % 341), j / 341);
    vec4 r0 = texelFetch(nodes, from, 0), r1 = texelFetch(nodes, from + ivec2(1, 0), 0), r2 = texelFetch(nodes, from + ivec2(2, 0), 0);
    vec3 p = vec3(dot(r0, rest), dot(r1, rest), dot(r2, rest));
    if (k == 0) first = p;
    vec3 aside = p - first;
    at += aside * link.y;
    rows += mat3(r0.xyz, r1.xyz, r2.xyz) * link.y;
    driftU += aside * link.z;
    driftV += aside * link.w;
    if (valued) value += texelFetch(values, ivec2(j % 341, j / 341), 0).x * link.y;
  }
  vec3 t0 = firstTangent(n);
  vec3 t1 = cross(n, t0);
  vec3 a = t0 * rows, b = t1 * rows, c = n * rows;
  vec3 u = clampLength(a + driftU, maxStretch) * radius;
  vec3 v = clampLength(b + driftV, maxStretch) * radius;
  vec3 raw = cross(a, b);
  float size = length(raw);
  vec3 bendU = vec3(0.0), bendV = vec3(0.0);
  if (size > 0.0) {
    float per = radius / size;
    vec3 c0 = cross(b, c) * per, c1 = cross(c, a) * per;
    n = raw / size;
    bendU = c0 * shape.x + c1 * shape.y;
    bendV = c0 * shape.y + c1 * shape.z;
  }
  // Equivalent strain: √(2/3) of the size of the deviator of (FᵀF − 1) / 2.
  vec3 stretch = vec3(dot(rows[0], rows[0]), dot(rows[1], rows[1]), dot(rows[2], rows[2]));
  vec3 mixed = vec3(dot(rows[0], rows[1]), dot(rows[1], rows[2]), dot(rows[2], rows[0]));
  stretch -= dot(stretch, vec3(1.0 / 3.0));
  out0 = vec4(first + at, valued ? value : sqrt((dot(stretch, stretch) + 2.0 * dot(mixed, mixed)) / 6.0));
  out1 = vec4(u, bendV.x);
  out2 = vec4(v, bendV.y);
  out3 = vec4(n, record(i, 3).w);
  out4 = vec4(bendU, bendV.z);
}`,
};

const CAMERA = `
uniform vec3 eye;
uniform mat3 axes;
uniform float focal;
uniform float aspect;
uniform float nearest;
vec3 toCamera(vec3 p) { return (p - eye) * axes; }
vec4 onScreen(vec3 c) { return vec4(2.0 * focal / aspect * c.x, 2.0 * focal * c.y, -c.z - 2.0 * nearest, -c.z); }
`;

/** Colours of values from 0 to 1 (sRGB): those of `phyxel-splat`'s legends. */
export const STOPS = [[0.267, 0.005, 0.329], [0.23, 0.322, 0.545], [0.128, 0.567, 0.551], [0.369, 0.789, 0.383], [0.993, 0.906, 0.144]];
const SCALE = `
const vec3 STOPS[5] = vec3[5](${STOPS.map((stop) => `vec3(${stop})`)});
vec3 scaleColor(float value) {
  float place = clamp(value, 0.0, 1.0) * 4.0;
  int k = min(int(place), 3);
  vec3 c = mix(STOPS[k], STOPS[k + 1], place - float(k));
  return mix(pow((c + 0.055) / 1.055, vec3(2.4)), c / 12.92, vec3(lessThanEqual(c, vec3(0.04045))));
}
`;

/** A disk before the camera: what is drawn of it, and where. Those that are not seen end here. */
const DISK = `${HEAD}${TANGENTS}${RECORD}${CAMERA}${SCALE}
uniform sampler2D carried0;
uniform sampler2D carried1;
uniform sampler2D carried2;
uniform sampler2D carried3;
uniform sampler2D carried4;
uniform float samples;
uniform bool gaps;
uniform vec4 surfaces[4];
/** What colours the surface: nothing, displacement (m), or what was carried; and the value of the last colour. */
uniform int coloring;
uniform float most;
flat out float radius; flat out float overhang; flat out int clipAt;
`;
const project = (of) => `
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  ivec2 at = ivec2((${of}) % PER_ROW, (${of}) / PER_ROW);
  vec4 place = texelFetch(carried0, at, 0), turned = texelFetch(carried3, at, 0);
  vec3 arm = place.xyz - eye;
  float cosine = dot(turned.xyz, arm) / length(arm);
  bool away = cosine >= 0.0;
  if (away && !(gaps && cosine > 0.3)) return;
  vec4 u = texelFetch(carried1, at, 0), v = texelFetch(carried2, at, 0);
  vec3 c = toCamera(place.xyz);
  float depth = -c.z;
  if (depth <= 0.0) return;
  vec3 cu = u.xyz * axes, cv = v.xyz * axes;
  vec3 g = cross(cu, cv);
  if (abs(dot(g, c)) <= 1e-4 * length(g) * length(c)) return;
  if (cu.z * cu.z + cv.z * cv.z >= 0.96 * depth * depth) return;
  vec2 which = texelFetch(shown, at, 0).xy;
  int i = int(which.x);
  vec4 rest = record(i, 0);
  radius = rest.w * which.y;
  overhang = 0.6 * depth / (focal * samples);
  clipAt = int(turned.w) - 1;
`;
/** Colour of the disk and strength of its highlight; normal and its changes along the axes, before the camera. */
const PAINT = `
  vec4 normal = record(i, 1);
  vec4 surface = surfaces[min(int(normal.w), 3)];
  vec4 bend = texelFetch(carried4, at, 0);
  vec3 facing = turned.xyz * axes, bend0 = bend.xyz * axes, bend1 = vec3(u.w, v.w, bend.w) * axes;
  vec4 color = vec4(record(i, 3).xyz, surface.x);
  if (coloring > 0) color.xyz = scaleColor((coloring == 1 ? distance(place.xyz, rest.xyz) : place.w) / most);
`;

/** A triangle about each disk, in its plane. Software draws plain triangles several times as fast as instances of a quad. */
const splatVertex = (paint) => `${DISK}
uniform float tolerance;
out vec2 disk;
${paint ? "flat out int back; flat out vec3 towards; flat out vec3 turn0; flat out vec3 turn1; flat out vec4 tint; flat out vec4 point; flat out vec3 along0; flat out vec3 along1;" : ""}
const vec2 CORNERS[3] = vec2[3](vec2(0.0, 2.0), vec2(-1.7320508, -1.0), vec2(1.7320508, -1.0));
void main() {${project("gl_VertexID / 3")}
  disk = CORNERS[gl_VertexID % 3];
  gl_Position = onScreen(c + cu * disk.x + cv * disk.y);
${paint ? `
  // What lies no farther behind the nearest than the tolerance passes the test of depth; what faces away, where nothing is.
  float slack = tolerance * max(length(u.xyz), length(v.xyz)) / (depth * depth);
  gl_Position.z = away ? 0.99999 * gl_Position.w : gl_Position.z - 2.0 * nearest * slack * gl_Position.w;
  back = int(away);
  if (away) return;
${PAINT}
  towards = facing; turn0 = bend0; turn1 = bend1; tint = color;
  vec3 t0 = firstTangent(normal.xyz);
  point = vec4(rest.xyz * surface.w, surface.z);
  along0 = t0 * (rest.w * surface.w);
  along1 = cross(normal.xyz, t0) * (rest.w * surface.w);` : ""}
}`;

/** Leaves out what is not of the disk, beyond an edge of its clip or behind a wall. */
const IN_DISK = `
flat in float radius; flat in float overhang; flat in int clipAt;
uniform sampler2D clips;
vec4 clipTexel(int i) { return texelFetch(clips, ivec2(i % 1024, i / 1024), 0); }
float turn(vec2 a, vec2 b) { return a.x * b.y - a.y * b.x; }
bool hidden(vec2 p) {
  vec4 head = clipTexel(clipAt);
  int at = clipAt + 1;
  int edges = at + int(head.z);
  for (; at < edges; at += 1) {
    vec4 edge = clipTexel(at);
    if (edge.z + overhang - dot(p, edge.xy) < 0.0) return true;
  }
  vec2 q = p - head.xy;
  int walls = at + int(head.w);
  for (; at < walls; at += 1) {
    vec4 wall = clipTexel(at);
    vec2 a = wall.xy - head.xy, b = wall.zw - head.xy;
    if (turn(a, b) < 0.0) { vec2 c = a; a = b; b = c; }
    float size = length(b - a);
    if (size == 0.0) continue;
    vec2 way = (b - a) / size;
    if (turn(a, q) >= 0.0 && turn(q, b) >= 0.0 && overhang + turn(way, q - a) < 0.0) return true;
  }
  return false;
}
`;

/** First pass: depth of the nearest disk. */
export const NEARNESS = {
  vertex: splatVertex(false),
  fragment: `${HEAD}${IN_DISK}
in vec2 disk;
void main() {
  if (dot(disk, disk) > 1.0 || (clipAt >= 0 && hidden(disk * radius))) discard;
}`,
};

/** Second pass: what is near enough is added up, with positions at rest; gaps get the colour of the inside. */
export const BLEND = {
  vertex: splatVertex(true),
  fragment: `${HEAD}${IN_DISK}
in vec2 disk;
flat in int back; flat in vec3 towards; flat in vec3 turn0; flat in vec3 turn1; flat in vec4 tint; flat in vec4 point; flat in vec3 along0; flat in vec3 along1;
uniform vec3 inside;
layout(location = 0) out vec4 sumNormal;
layout(location = 1) out vec4 sumColor;
layout(location = 2) out vec4 sumPoint;
void main() {
  float squared = dot(disk, disk);
  if (squared > 1.0 || (clipAt >= 0 && hidden(disk * radius))) discard;
  if (back == 1) {
    sumNormal = vec4(0.0, 0.0, 1.0, 1.0);
    sumColor = vec4(inside, 0.0);
    sumPoint = vec4(0.0);
    return;
  }
  float fall = 1.0 - squared;
  float weight = fall * fall + 1e-4;
  sumNormal = vec4(towards + turn0 * disk.x + turn1 * disk.y, 1.0) * weight;
  sumColor = tint * weight;
  sumPoint = vec4(point.xyz + along0 * disk.x + along1 * disk.y, point.w) * weight;
}`,
};

/** Light as the screen shows it (sRGB). */
const ENCODED = `
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  // Roots are several times as fast as powers for software, and differ by less than a 255th.
  vec3 r = sqrt(c), q = sqrt(r);
  return mix(0.585122381 * r + 0.783140355 * q - 0.368262736 * sqrt(q), 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}
`;

/** Light: an operating lamp from the upper left, a cool fill from the right, a rim from behind. */
const LIGHT = `
const vec3 DIRECTIONS[3] = vec3[3](${[[-0.45, 0.75, 0.65], [0.9, 0.15, 0.5], [0.2, 0.6, -0.75]].map((d) => `vec3(${unit(d).join(", ")})`).join(", ")});
const vec3 LIGHTS[3] = vec3[3](vec3(2.1, 2.0, 1.9), vec3(0.38, 0.42, 0.5), vec3(0.5, 0.5, 0.55));
const vec3 SKY = vec3(0.30, 0.31, 0.34);
const vec3 GROUND = vec3(0.12, 0.09, 0.08);
float powerOf(float base, float exponent) {
  float n = exponent * 0.25;
  float x = base / (n - n * base + base);
  return (x * x) * (x * x);
}
vec3 shade(vec3 n, vec3 view, vec3 color, float specular, float shininess, float softness) {
  vec3 hemisphere = (n.y * 0.5 + 0.5) * (SKY - GROUND) + GROUND;
  float past = 1.0 - clamp(dot(n, view), 0.0, 1.0);
  float grazing = past * past;
  float fresnel = grazing * grazing * past * 2.0 + 1.0;
  vec3 diffuse = hemisphere;
  vec3 highlight = hemisphere * (fresnel * 0.12);
  for (int k = 0; k < 3; k += 1) {
    vec3 towards = DIRECTIONS[k];
    float cosine = dot(n, towards);
    float lambert = max(cosine, 0.0);
    float leak = max((cosine + 0.35) / 1.35, 0.0);
    float soft = max(leak * leak - lambert, 0.0) * softness;
    vec3 middle = towards + view;
    float shine = powerOf(max(dot(n, middle) / max(length(middle), 1e-30), 0.0), shininess);
    shine *= fresnel * min(lambert * 4.0, 1.0);
    diffuse += LIGHTS[k] * (vec3(1.0, 0.25, 0.2) * soft + lambert);
    highlight += LIGHTS[k] * shine;
  }
  return color * diffuse + highlight * specular;
}
vec3 toned(vec3 c) {
  c = max(c, 0.0);
  return mix(1.0 - 0.25 / max(c, 1e-6), c, vec3(lessThanEqual(c, vec3(0.5))));
}
${ENCODED}`;

const NOISE = `
uint hashOf(ivec3 p) {
  uvec3 q = uvec3(p);
  uint h = q.x * 0x8da6b343u ^ q.y * 0xd8163841u ^ q.z * 0xcb1ab31fu;
  h ^= h >> 15; h *= 0x2c1b3c6du; h ^= h >> 12; h *= 0x297a2d39u;
  return h ^ (h >> 15);
}
vec3 slopeOf(uint h) {
  float a = (h & 4u) == 0u ? 1.0 : -1.0;
  float b = (h & 8u) == 0u ? 1.0 : -1.0;
  uint way = h & 3u;
  return way == 0u ? vec3(a, b, 0.0) : way == 1u ? vec3(0.0, a, b) : vec3(b, 0.0, a);
}
vec3 slopeNoise(vec3 p) {
  vec3 cell = floor(p);
  ivec3 at = ivec3(cell);
  vec3 f = p - cell;
  vec3 s = f * f * (3.0 - 2.0 * f);
  vec3 sum[4];
  for (int k = 0; k < 4; k += 1) {
    ivec3 corner = at + ivec3(0, k & 1, k >> 1);
    sum[k] = mix(slopeOf(hashOf(corner)), slopeOf(hashOf(corner + ivec3(1, 0, 0))), s.x);
  }
  return mix(mix(sum[0], sum[1], s.y), mix(sum[2], sum[3], s.y), s.z);
}
`;

/** What is behind the bodies. */
const BEHIND = `
uniform vec2 size;
uniform float focal;
uniform vec3 top;
uniform vec3 bottom;
uniform vec3 eye;
uniform mat3 axes;
/** Middle (m) and radius (m) of the floor, 0 for none, and the distance (m) of its lines. */
uniform vec4 ground;
uniform float lines;
/** A floor that fades away, with lines and a soft shadow below its middle; \`at\` from the lower left. */
vec3 behindAt(vec2 at) {
  vec3 sky = mix(top, bottom, 1.0 - at.y / size.y);
  vec3 way = axes * vec3((at - 0.5 * size) / (focal * size.y), -1.0);
  float t = (ground.z - eye.z) / way.z;
  if (ground.w == 0.0 || way.z >= 0.0 || t <= 0.0) return sky;
  vec2 p = eye.xy + way.xy * t - ground.xy;
  float fade = 1.0 - dot(p, p) / (ground.w * ground.w);
  if (fade <= 0.0) return sky;
  vec2 apart = abs(fract(p / lines + 0.5) - 0.5) * lines;
  vec2 wide = vec2(t / (focal * size.y)) * vec2(1.0, -length(way) / way.z);
  vec2 on = clamp(1.5 - apart / wide, 0.0, 1.0);
  float under = max(6.0 * fade - 5.0, 0.0);
  return sky * (1.0 + fade * fade * (0.25 * max(on.x, on.y) - 0.45 * under * under));
}
`;

/** Third pass: sums are normalised and lit; \`supersampling\` samples to a side of a pixel. */
export const RESOLVE = {
  vertex: WHOLE,
  fragment: `${HEAD}${LIGHT}${NOISE}${BEHIND}
uniform sampler2D sumNormal;
uniform sampler2D sumColor;
uniform sampler2D sumPoint;
uniform int supersampling;
uniform vec4 surfaces[4];
out vec4 pixel;
vec3 lit(ivec2 place, vec4 normal, vec4 color, vec3 view) {
  float per = 1.0 / normal.w;
  vec3 mean = normal.xyz * per;
  float known = length(mean);
  vec3 n = known > 0.0 ? mean / known : view;
  known = min(known, 1.0);
  float specular = color.w * per;
  float span = surfaces[1].x - surfaces[0].x;
  float blend = abs(span) > 1e-6 ? (specular - surfaces[0].x) / span : 0.0;
  float shininess = max(mix(surfaces[0].y, surfaces[1].y, blend), 1.0);
  float share = known / (known + shininess * (1.0 - known));
  specular *= (1.0 + share * shininess) / (1.0 + shininess);
  shininess *= share;
  vec4 point = texelFetch(sumPoint, place, 0) * per;
  if (point.w > 0.0) {
    vec3 tilt = slopeNoise(point.xyz);
    n = normalize(n + (tilt - n * dot(tilt, n)) * point.w);
  }
  return toned(shade(n, view, color.xyz * per, specular, shininess, 0.5));
}
void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * supersampling;
  vec2 middle = 0.5 * size;
  vec3 sum = vec3(0.0);
  vec2 at = vec2(first) + 0.5;
  vec3 view = normalize(vec3((middle - at) / (focal * size.y), 1.0));
  for (int k = 0; k < supersampling * supersampling; k += 1) {
    ivec2 place = first + ivec2(k % supersampling, k / supersampling);
    vec4 normal = texelFetch(sumNormal, place, 0);
    sum += normal.w > 0.0
      ? lit(place, normal, texelFetch(sumColor, place, 0), view)
      : behindAt(vec2(place) + 0.5);
  }
  pixel = vec4(encoded(sum / float(supersampling * supersampling)), 1.0);
}`,
};

/** While pictures come slowly, in one pass: a point about each disk, lit at its middle and at half its axes; the nearest is seen alone. */
export const POINT = {
  vertex: `${DISK}${LIGHT}
flat out vec4 toDisk; flat out vec3 deep; flat out vec3 tint; flat out vec3 tint0; flat out vec3 tint1;
uniform vec3 inside;
void main() {${project("gl_VertexID")}
  gl_Position = onScreen(c);
  // Pixels that the axes span, and the square about the ellipse; what spans it in units of the disk.
  float per = focal * samples / depth;
  vec2 along0 = (cu.xy + c.xy * (cu.z / depth)) * per, along1 = (cv.xy + c.xy * (cv.z / depth)) * per;
  float reach = max(length(vec2(along0.x, along1.x)), length(vec2(along0.y, along1.y))) + 0.5;
  gl_PointSize = 2.0 * reach;
  float turned0 = along0.x * along1.y - along1.x * along0.y;
  toDisk = vec4(along1.y, -along0.y, -along1.x, along0.x) * (reach / turned0);
  deep = vec3(1.0, 0.0, 0.0) - nearest * vec3(1.0, cu.z / depth, cv.z / depth) / depth;
  if (away) deep = vec3(0.99999, 0.0, 0.0);
${PAINT}
  vec3 view = normalize(-c);
  tint = away ? encoded(toned(inside)) : encoded(toned(shade(normalize(facing), view, color.xyz, color.w, surface.y, 0.5)));
  tint0 = away ? vec3(0.0) : 2.0 * (encoded(toned(shade(normalize(facing + 0.5 * bend0), view, color.xyz, color.w, surface.y, 0.5))) - tint);
  tint1 = away ? vec3(0.0) : 2.0 * (encoded(toned(shade(normalize(facing + 0.5 * bend1), view, color.xyz, color.w, surface.y, 0.5))) - tint);
}`,
  fragment: `${HEAD}${IN_DISK}
flat in vec4 toDisk; flat in vec3 deep; flat in vec3 tint; flat in vec3 tint0; flat in vec3 tint1;
out vec4 pixel;
void main() {
  vec2 disk = mat2(toDisk.xy, toDisk.zw) * (vec2(2.0, -2.0) * gl_PointCoord + vec2(-1.0, 1.0));
  if (dot(disk, disk) > 1.0 || (clipAt >= 0 && hidden(disk * radius))) discard;
  pixel = vec4(tint + tint0 * disk.x + tint1 * disk.y, 1.0);
  gl_FragDepth = deep.x + deep.y * disk.x + deep.z * disk.y;
}`,
};

/** What is behind the points. */
export const BACKGROUND = {
  vertex: WHOLE,
  fragment: `${HEAD}${BEHIND}
${ENCODED}
out vec4 pixel;
void main() {
  pixel = vec4(encoded(behindAt(gl_FragCoord.xy)), 1.0);
}`,
};

/** Tools: opaque where they are in front of tissue, a shadow of themselves where they are inside. */
export const TOOL = {
  vertex: `${HEAD}${CAMERA}
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
uniform vec3 place;
uniform vec4 turn;
out vec3 facing;
out vec3 at;
vec3 turned(vec3 v) { return v + 2.0 * cross(turn.xyz, cross(turn.xyz, v) + turn.w * v); }
void main() {
  vec3 c = toCamera(turned(position) + place);
  facing = turned(normal) * axes;
  at = c;
  gl_Position = onScreen(c);
}`,
  fragment: `${HEAD}${LIGHT}
in vec3 facing;
in vec3 at;
uniform sampler2D seen;
uniform float nearest;
uniform int supersampling;
uniform vec3 color;
uniform float opacity;
uniform float hiddenOpacity;
uniform float specular;
out vec4 pixel;
void main() {
  float limit = (1.0 - texelFetch(seen, ivec2(gl_FragCoord.xy) * supersampling, 0).x) / nearest;
  vec3 n = normalize(facing);
  vec3 view = normalize(-at);
  if (dot(n, view) < 0.0) n = -n;
  float share = gl_FragCoord.w < limit ? hiddenOpacity : opacity;
  pixel = vec4(encoded(toned(shade(n, view, color, specular, 90.0, 0.0))) * share, share);
}`,
};
