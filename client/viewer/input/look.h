// Drawing options that a person can change while looking: keys and panel write them, sources read them.
#pragma once

#include <cstdint>

#include "common/image/shading.h"
#include "common/splat/render_options.h"

namespace telesplat::viewer {

struct Look {
  static constexpr double kLeastDetail = 0.25;

  splat::RenderOptions render;
  bool lit = true;
  bool head_light = false;                                      ///< if lit: by the head light alone
  uint32_t background = image::ShadingParameters{}.background;  ///< 0x00RRGGBB
  double most_detail = 1;  ///< upper limit of splat::SelectionOptions::detail, kLeastDetail to 1
};

inline bool operator==(const Look& a, const Look& b) {
  return a.render.kernel == b.render.kernel &&
         splat::finish_bits(a.render.finish) == splat::finish_bits(b.render.finish) && a.lit == b.lit &&
         a.head_light == b.head_light && a.background == b.background && a.most_detail == b.most_detail;
}

/// Copies into `now` the values that differ between two looks, as the second one has them.
inline Look changed(Look now, const Look& from, const Look& to) {
  const auto take = [](auto& at, const auto& before, const auto& after) {
    if (before != after) at = after;
  };
  auto& finish = now.render.finish;
  const auto &old = from.render.finish, &next = to.render.finish;
  take(now.render.kernel, from.render.kernel, to.render.kernel);
  take(finish.fill, old.fill, next.fill);
  take(finish.smooth, old.smooth, next.smooth);
  take(finish.antialias, old.antialias, next.antialias);
  take(now.lit, from.lit, to.lit);
  take(now.head_light, from.head_light, to.head_light);
  take(now.background, from.background, to.background);
  take(now.most_detail, from.most_detail, to.most_detail);
  return now;
}

/// Puts the lights and the background of a look into `shading`.
inline void put_into(const Look& look, image::ShadingParameters& shading) {
  const auto lights = image::shading_named(look.head_light ? "head" : "lit");
  shading.ambient = lights->ambient;
  shading.head = lights->head;
  shading.key = lights->key;
  shading.lit = look.lit;
  shading.background = look.background;
}

/// The look that a display begins with.
inline Look first_look(const splat::RenderOptions& render, const image::ShadingParameters& shading) {
  return {.render = render,
          .lit = shading.lit,
          .head_light = shading.key == image::shading_named("head")->key,
          .background = shading.background};
}

/// A person's wish for a picture of the scene on display.
struct PictureWish {
  int width = 0, height = 0;  ///< pixels; 0: size of the display
  bool exr = false;           ///< EXR with depth, else PNG
  bool own_size() const { return width > 0 && height > 0; }
  bool operator==(const PictureWish&) const = default;
};

}  // namespace telesplat::viewer
