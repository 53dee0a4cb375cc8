// Warps a volume's layers: one pass over the display; each pixel looks through all layers
// (common/volume/warp/warper.h).
#pragma once

#include <string_view>

namespace telesplat::viewer::shaders {

/// A triangle that covers the display.
inline constexpr std::string_view kVolumeVertex = R"(
void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 4 * (gl_VertexID >> 1) - 1, 0, 1); }
)";

/// MAX_LAYERS, NEAREST_W, SOLID, DONE: the same values as on the processor.
inline constexpr std::string_view kVolumeFragment = R"(
struct Layer {
  vec4 row_x, row_y, row_w;  // of xyz: to texels, whole numbers at their centres
  vec4 range;                // last texels; depth, over w; slice of the texture
};
layout(std140, binding = 0) uniform Layers { Layer layers[MAX_LAYERS]; };
layout(binding = 0) uniform sampler2DArray images;
layout(location = 0) uniform int layer_count;
layout(location = 1) uniform vec3 background;
layout(location = 0) out vec4 colour;
layout(location = 1) out float depth_m;

void main() {
  vec3 pixel = vec3(gl_FragCoord.xy, 1);  // row 0 is the upper row of the picture
  vec2 size = vec2(textureSize(images, 0).xy);
  vec4 sum = vec4(0);
  float depth = uintBitsToFloat(0x7f800000u);
  for (int i = 0; i < layer_count; ++i) {
    Layer layer = layers[i];
    float w = dot(layer.row_w.xyz, pixel);
    if (w < NEAREST_W) continue;
    vec2 at = vec2(dot(layer.row_x.xyz, pixel), dot(layer.row_y.xyz, pixel)) / w;
    if (any(lessThan(at, vec2(0))) || any(greaterThan(at, layer.range.xy))) continue;
    sum += (1 - sum.a) * textureLod(images, vec3((at + 0.5) / size, layer.range.w), 0);
    if (sum.a >= SOLID) depth = min(depth, layer.range.z / w);
    if (sum.a > DONE) {
      sum.a = 1;
      break;
    }
  }
  colour = vec4(sum.rgb + (1 - sum.a) * background, sum.a);  // alpha: how much the volume covers
  depth_m = depth;
}
)";

}  // namespace telesplat::viewer::shaders
