#include "tools/lab/simulation/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "tools/lab/simulation/dice.h"

namespace telesplat::simulation {
namespace {

constexpr double kCalmBegins_s = 1;  // before the calm no fault begins that lasts

double smooth(double t) { return t * t * (3 - 2 * t); }

// A place around the scene, at eye height and above.
glm::dvec3 draw_place(Dice& dice) {
  glm::dvec3 at;
  do at = {dice.between(-1, 1), dice.between(-0.1, 0.8), dice.between(-1, 1)};
  while (glm::dot(at, at) > 1 || glm::dot(at, at) < 0.2);
  return glm::normalize(at) * dice.between(0.75, 1.6);
}

Part draw_server(Dice& dice, const Scenario& s) {
  switch (dice.below(10)) {
    case 0:
      return {Role::kMaster, 0};
    case 1:
      return {Role::kData, 0};
    case 2:
    case 3:
    case 4:
      return {Role::kPacker, 0};
    default:
      return {Role::kSampler, int(dice.below(uint64_t(s.samplers)))};
  }
}
Part draw_viewer(Dice& dice, const Scenario& s) { return {Role::kViewer, int(dice.below(uint64_t(s.viewers)))}; }
Part draw_anybody(Dice& dice, const Scenario& s) {
  return dice.chance(0.25) ? draw_viewer(dice, s) : draw_server(dice, s);
}

// Two who are connected.
std::pair<Part, Part> draw_connected(Dice& dice, const Scenario& s) {
  const Part sampler{Role::kSampler, int(dice.below(uint64_t(s.samplers)))}, viewer = draw_viewer(dice, s);
  switch (dice.below(6)) {
    case 0:
      return {sampler, {Role::kPacker, 0}};
    case 1:
      return {sampler, {Role::kData, 0}};
    case 2:
    case 3:
      return {viewer, {Role::kPacker, 0}};
    case 4:
      return {{Role::kPacker, 0}, {Role::kMaster, 0}};
    default:
      return {draw_anybody(dice, s), {Role::kMaster, 0}};
  }
}

Event draw_order(Dice& dice, const Scenario& s, double at_s) {
  constexpr Fault kOrders[] = {Fault::kEpoch, Fault::kClip, Fault::kCoupling, Fault::kStatus};
  Event e{.at_s = at_s, .fault = kOrders[dice.below(4)], .a = {Role::kMaster, 0}, .b = draw_viewer(dice, s)};
  if (e.fault == Fault::kClip) e.amount = double(dice.below(3));
  if (e.fault == Fault::kCoupling) e.amount = double(dice.below(5));
  return e;
}

Event draw_event(Dice& dice, const Scenario& s, double at_s, double calm_at_s) {
  constexpr Fault kOften[] = {Fault::kKill,      Fault::kKillAtMessage, Fault::kTerminate, Fault::kStop,
                              Fault::kBreak,     Fault::kBreak,         Fault::kSilence,   Fault::kIsolate,
                              Fault::kClockStep, Fault::kSlowLink,      Fault::kSlowWork,  Fault::kDiskFull,
                              Fault::kLeave,     Fault::kJoin,          Fault::kStranger,  Fault::kImpostor};
  Event e{.at_s = at_s, .fault = kOften[dice.below(std::size(kOften))], .a = draw_anybody(dice, s), .b = {}};
  const double longest_s = calm_at_s - at_s;
  switch (e.fault) {
    case Fault::kKill:
    case Fault::kTerminate:
      e.amount = std::min(longest_s, dice.between(0.1, 2));
      break;
    case Fault::kKillAtMessage:
      e.amount = double(1 + dice.below(60));
      break;
    case Fault::kStop:
    case Fault::kIsolate:
      e.amount = std::min(longest_s, dice.chance(0.7) ? dice.between(0.02, 1.5) : dice.between(1.5, 8));
      break;
    case Fault::kBreak:
    case Fault::kSilence:
      std::tie(e.a, e.b) = draw_connected(dice, s);
      if (e.fault == Fault::kSilence) e.amount = std::min(longest_s, dice.between(0.05, 4));
      break;
    case Fault::kClockStep:
      e.amount = dice.between(0.01, 3);
      break;
    case Fault::kSlowLink:
      e.a = draw_viewer(dice, s);
      e.amount = dice.between(1e4, 1e6);
      break;
    case Fault::kSlowWork:
      e.a = {Role::kSampler, int(dice.below(uint64_t(s.samplers)))};
      e.amount = dice.between(2, 100);
      break;
    case Fault::kDiskFull:
      e.amount = std::min(longest_s, dice.between(0.5, 3));
      break;
    case Fault::kLeave:
      e.a =
          dice.chance(0.5) && s.viewers > 1 ? Part{Role::kViewer, s.viewers - 1} : Part{Role::kSampler, s.samplers - 1};
      break;
    case Fault::kJoin:
      e.a = {dice.chance(0.5) ? Role::kViewer : Role::kSampler, 0};
      break;
    case Fault::kStranger:
      e.a = {dice.chance(0.6) ? Role::kMaster : Role::kPacker, 0};
      e.amount = double(1 + dice.below(40));
      break;
    case Fault::kImpostor:
      e.b = {dice.chance(0.5) ? Role::kSampler : Role::kViewer, 0};
      break;
    default:
      break;
  }
  return e;
}

void draw_links(Dice& dice, Scenario& s) {
  s.links = {.latency_s = dice.between(0.00005, 0.0005), .jitter_s = dice.chance(0.5) ? dice.between(0, 0.002) : 0};
  s.to_viewers = s.links;
  if (s.one_machine) return;
  s.to_viewers.latency_s = dice.between(0.0005, 0.08);
  s.to_viewers.jitter_s = dice.chance(0.5) ? dice.between(0, 0.02) : 0;
  if (dice.chance(0.5)) s.to_viewers.bytes_s = dice.between(1e5, 1e7);
}

void draw_settings(Dice& dice, Scenario& s) {
  auto& w = s.settings;
  w.steering = dice.chance(0.75);
  w.keep_redundant = !w.steering && dice.chance(0.2);
  if (dice.chance(0.3)) w.max_points = 40'000 + dice.below(40'000);
  if (dice.chance(0.2)) w.obsolete_after_s = dice.between(0.5, 6);
  if (dice.chance(0.3)) w.depth_error = dice.between(0, 0.5), w.normal_error = 4, w.colour_error = 8;
  if (dice.chance(0.3)) w.view_cell_m = 0;
  if (dice.chance(0.3)) w.still_rays = 1;
  if (dice.chance(0.15)) s.log_limit_mb = 1;
}

void add_events(Dice& dice, Scenario& s, double mean_apart_s) {
  const double calm_at_s = s.duration_s - s.calm_s;
  for (double at_s = dice.between(0, 2 * mean_apart_s); at_s < calm_at_s - kCalmBegins_s;
       at_s += dice.between(0, 2 * mean_apart_s))
    s.events.push_back(dice.chance(0.2) ? draw_order(dice, s, at_s)
                                        : draw_event(dice, s, at_s, calm_at_s - kCalmBegins_s / 2));
}

}  // namespace

std::string text_of(Part part) { return fmt::format("{}-{}", kRoleNames[size_t(part.role)], part.number); }

std::string text_of(const Event& e) {
  return fmt::format("{:9.4f} {} {} {} {:.4g}", e.at_s, kFaultNames[size_t(e.fault)], text_of(e.a), text_of(e.b),
                     e.amount);
}

// It goes from place to place, rests at some, and looks at what is near the middle.
geometry::Trajectory draw_head(uint64_t seed, double until_s) {
  constexpr double kSample_s = 0.05;
  Dice dice(seed ^ 0x68656164);
  std::vector<geometry::Trajectory::Sample> samples;
  glm::dvec3 from = draw_place(dice), from_target(0);
  double t_s = 0;
  while (t_s < until_s) {
    const bool rests = dice.chance(0.3);
    const glm::dvec3 to = rests ? from : draw_place(dice);
    const glm::dvec3 target =
        rests ? from_target : glm::dvec3(dice.between(-0.15, 0.15), dice.between(-0.1, 0.1), dice.between(-0.15, 0.15));
    const double end_s = t_s + (rests ? dice.between(0.3, 2.5) : dice.between(0.8, 4)), begin_s = t_s;
    for (; t_s < end_s && t_s < until_s; t_s += kSample_s) {
      const double u = smooth((t_s - begin_s) / (end_s - begin_s));
      glm::dvec3 eye = from + u * (to - from);
      if (const double r = glm::length(eye); r < 0.7) eye *= 0.7 / std::max(r, 0.05);  // not through it
      samples.push_back({t_s, geometry::look_at(eye, from_target + u * (target - from_target))});
    }
    from = to, from_target = target;
  }
  return geometry::Trajectory::of(std::move(samples));
}

Scenario draw_scenario(uint64_t seed) {
  Dice dice(seed);
  Scenario s{.seed = seed};
  s.duration_s = dice.between(11, 16);
  s.show = dice.chance(0.75) ? Show(dice.below(3)) : dice.chance(0.3) ? Show::kJulia : Show::kBall;
  s.samplers = 1 + int(dice.below(3));
  s.viewers = dice.chance(0.7) ? 1 : 2;
  s.one_machine = dice.chance(0.4);
  s.display_hz = dice.chance(0.3) ? 8 : 3;
  s.tile_size = dice.chance(0.5) ? 32 : 64;
  s.tile_s = dice.between(0.0005, 0.02);
  if (dice.chance(0.25))
    s.coupling = {viewer::CouplingMode::kSync, 1};
  else if (dice.chance(0.2))
    s.coupling = {viewer::CouplingMode::kLoose, 2 + int(dice.below(2))};
  s.keys = dice.chance(0.2);
  s.records = dice.chance(0.1);
  draw_links(dice, s);
  draw_settings(dice, s);
  if (!dice.chance(0.1)) add_events(dice, s, dice.between(0.3, 3));
  return s;
}

Scenario draw_long(uint64_t seed, double hours) {
  Dice dice(seed);
  Scenario s{.seed = seed};
  s.duration_s = hours * 3600;
  s.calm_s = 8;
  s.display_hz = 1.5;
  s.width = 32, s.height = 24;
  s.settings.still_rays = 1;
  s.settings.view_cell_m = 0;
  s.tile_s = 0.02;
  s.records = false;
  draw_links(dice, s);
  add_events(dice, s, 20);
  std::erase_if(s.events, [](const Event& e) { return e.fault == Fault::kJoin || e.fault == Fault::kLeave; });
  return s;
}

std::string text_of(const Scenario& s) {
  std::string out = fmt::format(
      "seed {}: {} for {:.1f} s, {} samplers, {} viewers at {} Hz, {}{}{}{}, steering {}, {:.0f} ms a tile, links "
      "{:.1f} "
      "ms, to viewers {:.1f} ms{}\n",
      s.seed, kShowNames[size_t(s.show)], s.duration_s, s.samplers, s.viewers, s.display_hz, coupling_text(s.coupling),
      s.one_machine ? ", one machine" : "", s.keys ? ", keys" : "", s.records ? ", record" : "",
      s.settings.steering ? "on" : "off", s.tile_s * 1e3, s.links.latency_s * 1e3, s.to_viewers.latency_s * 1e3,
      s.to_viewers.bytes_s > 0 ? fmt::format(", {:.0f} kB/s", s.to_viewers.bytes_s / 1e3) : "");
  const wire::SessionSettings plain;
  const auto usual = wire::numbers_of(plain);
  for (const auto& [name, value] : wire::numbers_of(s.settings))
    if (value != usual.at(name)) out += fmt::format("  {} {:.4g}\n", name, value);
  if (s.log_limit_mb < 512) out += fmt::format("  log_limit_mb {:.4g}\n", s.log_limit_mb);
  for (const Event& e : s.events) out += "  " + text_of(e) + "\n";
  return out;
}

}  // namespace telesplat::simulation
