// `telesplat autostereo PANEL.toml`: computes the figures of an autostereo display; writes test patterns for it;
// simulates what an eye sees of a picture on it.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <optional>

#include "client/stereo/autostereo/interleaver.h"
#include "client/stereo/autostereo/panel_file.h"
#include "client/stereo/pattern.h"
#include "client/viewer/input/head_movement.h"
#include "common/options/complain.h"
#include "tools/telesplat/command.h"

namespace telesplat::launcher {
namespace {

struct AutostereoOptions {
  std::string panel, left, right, pattern = "off", see, eye = "left", head, out;
  double eye_separation_m = 0.064;
};

options::Table table(AutostereoOptions& o) {
  return {
      {.flag = "panel", .value = &o.panel, .help = "TOML file of the display and its line screen", .required = true},
      {.flag = "--head",
       .value = &o.head,
       .help = "where the head is, x,y,z in metres from the display's middle: to the right, up, towards the person",
       .default_text = "straight before it, distance_m of the file"},
      {.flag = "--eye-separation",
       .value = &o.eye_separation_m,
       .help = "metres from eye to eye",
       .limits = options::Range{0, 1}},
      {.flag = "--pattern",
       .value = &o.pattern,
       .help = "writes a picture for the display, as eyes there need it: calibration (left red, right blue, a cross in "
               "the middle of both), test",
       .limits = stereo::pattern_names()},
      {.flag = "--left", .value = &o.left, .help = "the same of two pictures: the left eye's"},
      {.flag = "--right", .value = &o.right, .help = "and the right one's"},
      {.flag = "--see",
       .value = &o.see,
       .help =
           "a picture that is on the display; writes what an eye there would see of it through the lines, simulated"},
      {.flag = "--eye", .value = &o.eye, .help = "--see: left or right", .limits = options::Names{"left", "right"}},
      {.flag = "--out", .value = &o.out, .help = "PNG file to write"},
  };
}

Result<stereo::Eyes> eyes_of(const AutostereoOptions& o, const stereo::Panel& panel) {
  glm::dvec3 head(0, 0, panel.distance_m);
  if (!o.head.empty()) {
    const auto given = viewer::parse_point(o.head);
    if (!given) return Error{fmt::format("--head {}: {}", o.head, given.error().text)};
    head = *given;
  }
  const glm::dvec3 half(0.5 * o.eye_separation_m, 0, 0);
  const stereo::Eyes eyes{head - half, head + half};
  if (const Status s = stereo::validate(panel, eyes); !s)
    return Error{fmt::format("--head {}: {}", o.head, s.error().text)};
  return eyes;
}

void print(const stereo::Panel& panel, double separation_m) {
  const stereo::PanelFigures f = stereo::figures_of(panel, separation_m);
  std::printf("pixels             %d x %d of %.4f mm, %.3f x %.3f m\n", panel.width, panel.height, panel.pixel_m * 1e3,
              panel.width_m(), panel.height_m());
  std::printf("an eye's picture   %d x %d\n", panel.eye_size().width, panel.eye_size().height);
  std::printf("lines              %.2f pixels apart along a row\n", f.pixels_a_line);
  std::printf("best distance      %.3f m, of eyes %.0f mm apart\n", f.best_distance_m, separation_m * 1e3);
  std::printf("at %.3f m          the picture repeats itself after %.1f mm to the side\n", panel.distance_m,
              f.repeat_m * 1e3);
  std::printf("                   %.1f %% of an eye's light is the other one's; %.1f %% of subpixels are dark\n",
              f.crosstalk * 100, f.dark * 100);
}

// Returns the pictures of both eyes; nothing: no flag asks for pictures.
Result<std::optional<std::array<image::View, 2>>> pictures(const AutostereoOptions& o, const stereo::Panel& panel) {
  using Pictures = std::optional<std::array<image::View, 2>>;
  const auto pattern = *stereo::pattern_named(o.pattern);
  const auto size = panel.eye_size();
  if (pattern != stereo::Pattern::kNone) return Pictures(stereo::eye_patterns(pattern, size.width, size.height));
  if (o.left.empty() && o.right.empty()) return Pictures();
  if (o.left.empty() || o.right.empty()) return Error{"--left and --right belong together"};
  auto left = image::read_view(o.left), right = image::read_view(o.right);
  if (!left) return left.error();
  if (!right) return right.error();
  if (left->width != right->width || left->height != right->height)
    return Error{fmt::format("--right {}: has {}x{} pixels, --left {}x{}", o.right, right->width, right->height,
                             left->width, left->height)};
  return Pictures(std::array<image::View, 2>{std::move(*left), std::move(*right)});
}

int autostereo(AutostereoOptions o, const options::Given&) {
  const auto panel = stereo::read_panel(o.panel);
  if (!panel) return complain(panel.error());
  const auto eyes = eyes_of(o, *panel);
  if (!eyes) return complain(eyes.error());
  const auto both = pictures(o, *panel);
  if (!both) return complain(both.error());
  const bool makes = both->has_value() || !o.see.empty();
  if (makes == o.out.empty())
    return complain({makes ? "--out is needed: where to write the picture"
                           : "--out needs --pattern, --left and --right, or --see: what to write"});
  if (!makes) {
    print(*panel, o.eye_separation_m);
    return 0;
  }
  image::View picture;
  if (both->has_value()) {
    stereo::Interleaver(*panel).compose(*eyes, (**both)[0], (**both)[1], picture);
  } else {
    auto shown = image::read_view(o.see);
    if (!shown) return complain(shown.error());
    if (shown->width != panel->width || shown->height != panel->height)
      return complain({fmt::format("--see {}: has {}x{} pixels, the display {}x{}", o.see, shown->width, shown->height,
                                   panel->width, panel->height)});
    picture = stereo::seen_by(*panel, (*eyes)[o.eye == "left" ? 0 : 1], *shown);
  }
  if (const Status s = image::write_png(o.out, picture); !s) return complain(s.error(), 1);
  std::printf("%s: %d x %d pixels%s\n", o.out.c_str(), picture.width, picture.height,
              both->has_value() ? "" : ", simulated");
  return 0;
}

}  // namespace

Command autostereo_command() {
  return make_command(
      "autostereo", "tell what an autostereo display's line screen does, make patterns for it, simulate what eyes see",
      table, autostereo);
}

}  // namespace telesplat::launcher
