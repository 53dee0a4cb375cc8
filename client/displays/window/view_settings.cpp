#include "client/displays/window/view_settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <charconv>
#include <cmath>
#include <tuple>

#include "client/viewer/display/size_text.h"
#include "common/image/background.h"
#include "common/splat/kernel_traits.h"

namespace telesplat::viewer {
namespace {

using Change = Status (*)(ViewSettings& v, const std::string& value);

Error not_one_of(const std::string& value, const std::string& names) {
  return Error{fmt::format("\"{}\" is not {}", value.substr(0, 40), names)};
}

Status read_number(const std::string& value, double least, double most, double& out) {
  double number = 0;
  const auto end = value.data() + value.size();
  const auto read = std::from_chars(value.data(), end, number);
  if (value.empty() || read.ec != std::errc() || read.ptr != end || !(number >= least && number <= most))
    return Error{fmt::format("\"{}\" is no number of {:g} to {:g}", value.substr(0, 40), least, most)};
  out = number;
  return ok_status();
}

Status into(const Result<bool>& read, bool& out) {
  if (!read) return read.error();
  out = *read;
  return ok_status();
}

Status set_splat(ViewSettings& v, const std::string& value) {
  const auto kernel = splat::kernel_named(value);
  if (!kernel) return not_one_of(value, splat::kernel_list());
  v.look.render.kernel = *kernel;
  return ok_status();
}

Status set_finish(ViewSettings& v, const std::string& value) {
  const auto finish = splat::finish_named(value);
  if (!finish) return not_one_of(value, "on, off or some of fill,smooth,antialias");
  v.look.render.finish = *finish;
  return ok_status();
}

Status set_background(ViewSettings& v, const std::string& value) {
  const auto background = image::parse_background(value);
  if (!background) return background.error();
  if (background->transparent != v.transparent)
    return Error{v.transparent ? "this window began with --background transparent and keeps it"
                               : "transparent: a window begins with it, or not at all"};
  v.look.background = background->colour;
  return ok_status();
}

Status set_shading(ViewSettings& v, const std::string& value) {
  if (!image::shading_named(value)) return not_one_of(value, "lit, head or unlit");
  v.look.lit = value != "unlit";
  if (v.look.lit) v.look.head_light = value == "head";
  return ok_status();
}

Status set_sampling_size(ViewSettings& v, const std::string& value) {
  v.sampling.adaptive = value == "auto";
  if (v.sampling.adaptive) return ok_status();
  const auto size = parse_pair(value, 16, geometry::kMaxImageSide);
  if (!size) return not_one_of(value, fmt::format("auto, or WxH with both in 16..{}", geometry::kMaxImageSide));
  v.sampling.width = size->first, v.sampling.height = size->second;
  return ok_status();
}

Status set_stereo(ViewSettings& v, const std::string& value) {
  const auto mode = stereo::mode_named(value);
  if (!mode) return not_one_of(value, fmt::format("one of {}", fmt::join(stereo::mode_names(), ", ")));
  if (*mode == stereo::Mode::kAutostereo && !v.stereo.panel)
    return Error{"autostereo: a window begins with it, since --barrier names its display"};
  if ((*mode == stereo::Mode::kQuadBuffer) != v.quad_buffers)
    return Error{v.quad_buffers ? "this window began with quad-buffer and keeps it"
                                : "quad-buffer: a window begins with it, or not at all"};
  v.stereo.mode = *mode;
  return ok_status();
}

struct Row {
  const char* order;
  Change change;
  std::string (*text)(const ViewSettings& v);
  bool of_pictures = false;  ///< it changes pictures that servers drew, or overlays on them
};

std::string switch_text(bool on) { return on ? "on" : "off"; }

constexpr Row kRows[] = {
    {"splat", set_splat, [](const ViewSettings& v) { return std::string(splat::kernel_name(v.look.render.kernel)); }},
    {"finish", set_finish, [](const ViewSettings& v) { return splat::finish_name(v.look.render.finish); }},
    {"detail",
     [](ViewSettings& v, const std::string& s) { return read_number(s, Look::kLeastDetail, 1, v.look.most_detail); },
     [](const ViewSettings& v) { return fmt::format("{:g}", v.look.most_detail); }},
    {"background", set_background, [](const ViewSettings& v) { return fmt::format("#{:06x}", v.look.background); }},
    {"shading", set_shading,
     [](const ViewSettings& v) {
       return std::string(!v.look.lit ? "unlit" : v.look.head_light ? "head" : "lit");
     }},
    {"sampling-size", set_sampling_size,
     [](const ViewSettings& v) {
       return v.sampling.adaptive ? "auto" : fmt::format("{}x{}", v.sampling.width, v.sampling.height);
     },
     true},
    {"least-sampling",
     [](ViewSettings& v, const std::string& s) { return read_number(s, 0.1, 1, v.sampling.least_sampling); },
     [](const ViewSettings& v) { return fmt::format("{:g}", v.sampling.least_sampling); }, true},
    {"legend", [](ViewSettings& v, const std::string& s) { return into(read_switch(s), v.legend); },
     [](const ViewSettings& v) { return switch_text(v.legend); }, true},
    {"stereo", set_stereo, [](const ViewSettings& v) { return std::string(stereo::name_of(v.stereo.mode)); }},
    {"eye-separation",
     [](ViewSettings& v, const std::string& s) { return read_number(s, 0, 1, v.stereo.eye_separation_m); },
     [](const ViewSettings& v) { return fmt::format("{:g}", v.stereo.eye_separation_m); }},
    {"screen-distance",
     [](ViewSettings& v, const std::string& s) { return read_number(s, 0, 1000, v.stereo.screen_m); },
     [](const ViewSettings& v) { return fmt::format("{:g}", v.stereo.screen_m); }},
    {"swap-eyes", [](ViewSettings& v, const std::string& s) { return into(read_switch(s), v.stereo.swap_eyes); },
     [](const ViewSettings& v) { return switch_text(v.stereo.swap_eyes); }},
};

}  // namespace

Result<bool> read_switch(const std::string& value) {
  if (value == "on" || value == "off") return value == "on";
  return not_one_of(value, "on or off");
}

Status change(ViewSettings& settings, const std::string& order, const std::string& value) {
  for (const Row& row : kRows) {
    if (row.order != order) continue;
    if (settings.pictures && !row.of_pictures)
      return Error{"it changes nothing in pictures that the servers draw (--coupling images)"};
    ViewSettings changed = settings;
    if (const Status s = row.change(changed, value); !s) return s;
    settings = std::move(changed);
    return ok_status();
  }
  return Error{fmt::format("a window has no setting \"{}\"", order.substr(0, 40))};
}

std::map<std::string, std::string> values_of(const ViewSettings& settings) {
  std::map<std::string, std::string> out;
  for (const Row& row : kRows) out[row.order] = row.text(settings);
  return out;
}

ChosenSettings::ChosenSettings(const ViewerOptions& o, DisplayOptions& display)
    : display_(display),
      sampling_{o.requests.adaptive, o.requests.sampling_width, o.requests.sampling_height,
                o.least_sampling.value_or(o.requests.min_scale)},
      sampling_chosen_(o.least_sampling.has_value()),
      quad_buffers_(display.stereo.mode == stereo::Mode::kQuadBuffer) {}

ViewSettings ChosenSettings::get(const Look& look, bool pictures) const {
  return {.look = look,
          .transparent = display_.transparent,
          .sampling = sampling_,
          .stereo = display_.stereo,
          .quad_buffers = quad_buffers_,
          .legend = display_.legend,
          .pictures = pictures};
}

bool ChosenSettings::changes_eyes(const ViewSettings& settings) const {
  const auto eyes = [](const StereoOptions& o) {
    return std::tuple(o.mode, o.eye_separation_m, o.screen_m, o.swap_eyes);
  };
  return eyes(settings.stereo) != eyes(display_.stereo);
}

void ChosenSettings::set(const ViewSettings& settings) {
  if (changes_eyes(settings)) stereo_wish_ = display_.stereo = settings.stereo;
  if (settings.sampling != sampling_) {
    sampling_chosen_ = true;
    sampling_wish_ = sampling_ = settings.sampling;
  }
  display_.legend = settings.legend;
}

void ChosenSettings::follow(const wire::SessionSettings& session) {
  if (!sampling_chosen_) sampling_.least_sampling = session.least_sampling;
}

}  // namespace telesplat::viewer
