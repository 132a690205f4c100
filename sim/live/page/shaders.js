// Programs of the graphics card. What they compute is what `phyxel-splat` computes: `carry.rs`,
// `project.rs`, `raster.rs`, `resolve.rs`, `shade.rs`.

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
uniform int stride;
const int PER_ROW = 64;
const int OWN = 4;
vec4 record(int surfel, int k) {
  int each = OWN + stride;
  return texelFetch(records, ivec2((surfel % PER_ROW) * each + k, surfel / PER_ROW), 0);
}
`;

export const CARRY = {
  vertex: `${HEAD}${TANGENTS}${RECORD}
uniform sampler2D restNodes;
uniform sampler2D nodes;
uniform sampler2D gradients;
uniform float maxStretch;
out vec3 outX;
out vec3 outU;
out vec3 outV;
out vec3 outN;
out vec3 outBendU;
out vec3 outBendV;
vec3 node(sampler2D from, int i) { return texelFetch(from, ivec2(i % 1024, i / 1024), 0).xyz; }
mat3 gradient(int i) {
  ivec2 at = ivec2(3 * (i % 341), i / 341);
  mat3 apart = mat3(texelFetch(gradients, at, 0).xyz, texelFetch(gradients, at + ivec2(1, 0), 0).xyz,
                    texelFetch(gradients, at + ivec2(2, 0), 0).xyz);
  return mat3(1.0) + apart;
}
vec3 clampLength(vec3 v, float most) {
  float size = length(v);
  return size > most ? v * (most / size) : v;
}
void main() {
  int i = gl_VertexID;
  vec4 place = record(i, 0);
  vec4 facing = record(i, 1);
  vec3 shape = record(i, 2).xyz;
  vec3 rest = place.xyz;
  float radius = place.w;
  vec3 first = vec3(0.0), at = vec3(0.0), driftU = vec3(0.0), driftV = vec3(0.0);
  mat3 f = mat3(0.0);
  for (int k = 0; k < stride; k += 1) {
    vec4 link = record(i, OWN + k);
    int j = int(link.x);
    mat3 own = gradient(j);
    vec3 p = node(nodes, j) + own * (rest - node(restNodes, j));
    if (k == 0) first = p;
    vec3 aside = p - first;
    at += aside * link.y;
    f += own * link.y;
    driftU += aside * link.z;
    driftV += aside * link.w;
  }
  vec3 n = facing.xyz;
  vec3 t0 = firstTangent(n);
  vec3 t1 = cross(n, t0);
  vec3 a = f * t0, b = f * t1, c = f * n;
  outX = first + at;
  outU = clampLength(a + driftU, maxStretch) * radius;
  outV = clampLength(b + driftV, maxStretch) * radius;
  vec3 raw = cross(a, b);
  float size = length(raw);
  outN = n;
  outBendU = vec3(0.0);
  outBendV = vec3(0.0);
  if (size > 0.0) {
    float per = radius / size;
    vec3 c0 = cross(b, c) * per, c1 = cross(c, a) * per;
    outN = raw / size;
    outBendU = c0 * shape.x + c1 * shape.y;
    outBendV = c0 * shape.y + c1 * shape.z;
  }
  gl_Position = vec4(0.0);
}`,
  fragment: `${HEAD}
void main() {}`,
  feedback: ["outX", "outU", "outV", "outN", "outBendU", "outBendV"],
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

/** A quad in the plane of each disk. `clipped`: the disks with clips, or those without. */
const splatVertex = (clipped, paint) => `${HEAD}${TANGENTS}${RECORD}${CAMERA}
layout(location = 0) in vec3 x;
layout(location = 1) in vec3 u;
layout(location = 2) in vec3 v;
layout(location = 3) in vec3 n;
layout(location = 4) in vec3 bendU;
layout(location = 5) in vec3 bendV;
layout(location = 6) in float clip;
uniform float samples;
uniform float tolerance;
uniform int away;
uniform vec4 surfaces[4];
out vec2 disk;
flat out float slack;
${clipped ? "flat out float radius; flat out float overhang; flat out int clipAt;" : ""}
${paint ? `
flat out vec3 facing; flat out vec3 bend0; flat out vec3 bend1;
flat out vec4 color; flat out vec4 point; flat out vec3 along0; flat out vec3 along1;` : ""}
invariant gl_Position;
void main() {
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  disk = vec2(0.0);
  slack = 0.0;
  if ((clip >= 0.0) != ${clipped}) return;
  vec3 arm = x - eye;
  float cosine = dot(n, arm) / length(arm);
  if (away == 1 ? !(cosine > 0.3) : !(cosine < 0.0)) return;
  vec3 c = toCamera(x);
  float depth = -c.z;
  if (depth <= 0.0) return;
  vec3 cu = u * axes, cv = v * axes;
  vec3 g = cross(cu, cv);
  if (abs(dot(g, c)) <= 1e-4 * length(g) * length(c)) return;
  if (cu.z * cu.z + cv.z * cv.z >= 0.96 * depth * depth) return;
  vec2 corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;
  disk = corner;
  gl_Position = onScreen(c + cu * corner.x + cv * corner.y);
  slack = tolerance * max(length(u), length(v)) / (depth * depth);
${clipped ? `
  radius = record(gl_InstanceID, 0).w;
  overhang = 0.6 * depth / (focal * samples);
  clipAt = int(clip);` : ""}
${paint ? `
  vec4 rest = record(gl_InstanceID, 0);
  vec4 normal = record(gl_InstanceID, 1);
  vec4 surface = surfaces[min(int(normal.w), 3)];
  vec3 t0 = firstTangent(normal.xyz);
  facing = n * axes;
  bend0 = bendU * axes;
  bend1 = bendV * axes;
  color = vec4(record(gl_InstanceID, 3).xyz, surface.x);
  point = vec4(rest.xyz * surface.w, surface.z);
  along0 = t0 * (rest.w * surface.w);
  along1 = cross(normal.xyz, t0) * (rest.w * surface.w);` : ""}
}`;

/** Whether a fragment is hidden beyond an edge or behind a wall of its disk's clip. */
const HIDDEN = `
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

const inDisk = (clipped) => `
  float squared = dot(disk, disk);
  if (squared > 1.0) discard;
  ${clipped ? "if (hidden(disk * radius)) discard;" : ""}
`;
const CLIP_INPUTS = "flat in float radius; flat in float overhang; flat in int clipAt;";

/** First pass: nearness (1 / depth) of the nearest disk. */
export const nearness = (clipped) => ({
  vertex: splatVertex(clipped, false),
  fragment: `${HEAD}
in vec2 disk;
flat in float slack;
${clipped ? CLIP_INPUTS + HIDDEN : ""}
out float near;
void main() {${inDisk(clipped)}
  near = gl_FragCoord.w;
}`,
});

/** Second pass: what is near enough is added up. With \`away\`, gaps get the colour of the inside. */
export const blend = (clipped) => ({
  vertex: splatVertex(clipped, true),
  fragment: `${HEAD}
in vec2 disk;
flat in float slack;
${clipped ? CLIP_INPUTS + HIDDEN : ""}
flat in vec3 facing; flat in vec3 bend0; flat in vec3 bend1;
flat in vec4 color; flat in vec4 point; flat in vec3 along0; flat in vec3 along1;
uniform sampler2D seen;
uniform int away;
uniform vec3 inside;
layout(location = 0) out vec4 sumNormal;
layout(location = 1) out vec4 sumColor;
layout(location = 2) out vec4 sumPoint;
void main() {${inDisk(clipped)}
  float limit = texelFetch(seen, ivec2(gl_FragCoord.xy), 0).x;
  if (away == 1) {
    if (limit > 0.0) discard;
    sumNormal = vec4(0.0, 0.0, 1.0, 1.0);
    sumColor = vec4(inside, 0.0);
    sumPoint = vec4(0.0);
    return;
  }
  if (gl_FragCoord.w + slack < limit) discard;
  float fall = 1.0 - squared;
  float weight = fall * fall + 1e-4;
  sumNormal = vec4(facing + bend0 * disk.x + bend1 * disk.y, 1.0) * weight;
  sumColor = color * weight;
  sumPoint = vec4(point.xyz + along0 * disk.x + along1 * disk.y, point.w) * weight;
}`,
});

/** Light: an operating lamp from the upper left, a cool fill from the right, a rim from behind. */
const LIGHT = `
const vec3 DIRECTIONS[3] = vec3[3](vec3(-0.45, 0.75, 0.65), vec3(0.9, 0.15, 0.5), vec3(0.2, 0.6, -0.75));
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
    vec3 towards = normalize(DIRECTIONS[k]);
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
vec3 encoded(vec3 c) {
  c = clamp(c, 0.0, 1.0);
  return mix(1.055 * pow(c, vec3(1.0 / 2.4)) - 0.055, 12.92 * c, vec3(lessThanEqual(c, vec3(0.0031308))));
}
`;

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

/** A triangle over the whole picture. */
const WHOLE = `${HEAD}
void main() {
  gl_Position = vec4(vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 4.0 - 1.0, 0.0, 1.0);
}`;

/** Third pass: sums are normalised and lit; \`supersampling\` samples to a side of a pixel. */
export const RESOLVE = {
  vertex: WHOLE,
  fragment: `${HEAD}${LIGHT}${NOISE}
uniform sampler2D sumNormal;
uniform sampler2D sumColor;
uniform sampler2D sumPoint;
uniform int supersampling;
uniform vec2 size;
uniform float focal;
uniform vec4 surfaces[4];
uniform vec3 top;
uniform vec3 bottom;
out vec4 pixel;
vec3 lit(vec4 normal, vec4 color, vec4 point, vec3 view) {
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
  float amount = max(point.w * per, 0.0);
  if (amount > 0.0) {
    vec3 tilt = slopeNoise(point.xyz * per);
    n = normalize(n + (tilt - n * dot(tilt, n)) * amount);
  }
  return toned(shade(n, view, color.xyz * per, specular, shininess, 0.5));
}
void main() {
  ivec2 first = ivec2(gl_FragCoord.xy) * supersampling;
  vec2 middle = 0.5 * size;
  vec3 sum = vec3(0.0);
  float row = size.y - float(first.y + supersampling);
  vec3 behind = mix(top, bottom, row / size.y);
  vec2 at = vec2(first) + 0.5;
  vec3 view = normalize(vec3((middle - at) / (focal * size.y), 1.0));
  for (int k = 0; k < supersampling * supersampling; k += 1) {
    ivec2 place = first + ivec2(k % supersampling, k / supersampling);
    vec4 normal = texelFetch(sumNormal, place, 0);
    sum += normal.w > 0.0
      ? lit(normal, texelFetch(sumColor, place, 0), texelFetch(sumPoint, place, 0), view)
      : behind;
  }
  pixel = vec4(encoded(sum / float(supersampling * supersampling)), 1.0);
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
uniform int supersampling;
uniform vec3 color;
uniform float opacity;
uniform float hiddenOpacity;
uniform float specular;
out vec4 pixel;
void main() {
  float limit = texelFetch(seen, ivec2(gl_FragCoord.xy) * supersampling, 0).x;
  vec3 n = normalize(facing);
  vec3 view = normalize(-at);
  if (dot(n, view) < 0.0) n = -n;
  float share = gl_FragCoord.w < limit ? hiddenOpacity : opacity;
  pixel = vec4(encoded(toned(shade(n, view, color, specular, 90.0, 0.0))) * share, share);
}`,
};
