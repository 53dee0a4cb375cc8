#include "tools/lab/simulation/scenario.h"

#include <fmt/format.h>

#include <algorithm>
#include <glm/geometric.hpp>

#include "common/geometry/number_text.h"
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

Part draw_of(Dice& dice, Role role, int count) { return {role, int(dice.below(uint64_t(count)))}; }
Part draw_server(Dice& dice, const Scenario& s) {
  const uint64_t n = dice.below(10);
  if (n == 0) return {Role::kMaster, 0};
  if (n == 1) return draw_of(dice, Role::kData, s.data_servers);
  return n < 5 ? Part{Role::kPacker, 0} : draw_of(dice, Role::kSampler, s.samplers);
}
Part draw_viewer(Dice& dice, const Scenario& s) { return draw_of(dice, Role::kViewer, s.viewers); }
Part draw_anybody(Dice& dice, const Scenario& s) {
  return dice.chance(0.25) ? draw_viewer(dice, s) : draw_server(dice, s);
}

// Two who are connected.
std::pair<Part, Part> draw_connected(Dice& dice, const Scenario& s) {
  const Part sampler = draw_of(dice, Role::kSampler, s.samplers), packer{Role::kPacker, 0}, master{Role::kMaster, 0};
  const uint64_t n = dice.below(6);
  if (n == 0) return {sampler, packer};
  if (n == 1) return {sampler, draw_of(dice, Role::kData, s.data_servers)};
  if (n < 4) return {draw_viewer(dice, s), packer};
  return {n == 4 ? packer : draw_anybody(dice, s), master};
}

// Orders, separated by "/".
constexpr std::string_view kOrders =
    "epoch/status/clip|clip=off/clip|clip=plane x>=40%/clip|clip=plane y<=60%; plane z>=25%/"
    "clip|clip=plane 1,0.5,0,-0.1/clip|clip=box 15%,10%,20%,85%,90%,80%/coupling|coupling=async/"
    "coupling|coupling=sync/coupling|coupling=loose|buffers=2/coupling|coupling=loose|buffers=4|viewer=viewer-0";
constexpr std::string_view kOfJulia =
    "set|c.y=0.3/set|c.x=-0.3|c.z=0.1/animate|timeline=c.x=-0.4:-0.2:2s/animate|timeline=off/play|how=play/"
    "play|how=pause/play|how=step|steps=-3";
constexpr std::string_view kOfVolume =
    "set|volume.layers=1/set|volume.layers=3/tf|transfer=0:#204080:0, 80:#204080:0, 81:#40a0c0:0.2, 255:#ffffff:1/"
    "tf|transfer=0:#ff0000:0.25, 255:#ffffff:0.5/set|volume.step=1/animate|timeline=on/animate|timeline=off/"
    "play|how=step/play|how=play/play|how=pause";
constexpr std::string_view kWrong =
    "set|c.y=much/set|volume.step=9/set|volume.layers=0/set/clip|clip=plane x>=forty/clip/coupling|coupling=tight/"
    "coupling|coupling=sync|buffers=2/tf|transfer=0:blue:1/play|how=sideways/animate/colour|array=height/"
    "rotate|by=90/pick|at=50%,50%/light|light=head";

std::string draw_from(Dice& dice, std::string_view orders) {
  for (uint64_t n = dice.below(1 + uint64_t(std::ranges::count(orders, '/'))); n > 0; --n) take_until(orders, '/');
  return std::string(take_until(orders, '/'));
}

Event draw_order(Dice& dice, const Scenario& s, double at_s) {
  Event e{.at_s = at_s, .fault = Fault::kOrder, .a = {Role::kMaster, 0}, .b = draw_viewer(dice, s)};
  const bool own = dice.chance(0.6), wrong = dice.chance(0.15);
  const std::string_view of_show = s.show == Show::kJulia ? kOfJulia : is_volume(s.show) ? kOfVolume : kOrders;
  e.order = draw_from(dice, wrong ? kWrong : own ? of_show : kOrders);
  e.amount = wrong ? 1 : 0;
  return e;
}

Event draw_event(Dice& dice, const Scenario& s, double at_s, double calm_at_s) {
  using enum Fault;
  constexpr Fault kOften[] = {kKill,    kKillAtMessage, kTerminate, kStop,     kBreak,    kBreak,    kBreak,
                              kSilence, kIsolate,       kClockStep, kSlowLink, kSlowWork, kDiskFull, kLeave,
                              kJoin,    kStranger,      kImpostor,  kIntruder, kShow};
  const Fault f = kOften[dice.below(std::size(kOften))];
  Event e{.at_s = at_s, .fault = f, .a = draw_anybody(dice, s), .b = {}};
  const auto at_most = [&](double least, double most) { return std::min(calm_at_s - at_s, dice.between(least, most)); };
  if (f == kKill || f == kTerminate) e.amount = at_most(0.1, 2);
  if (f == kKillAtMessage) e.amount = double(1 + dice.below(60));
  if (f == kStop || f == kIsolate) e.amount = dice.chance(0.7) ? at_most(0.02, 1.5) : at_most(1.5, 8);
  if (f == kBreak || f == kSilence) std::tie(e.a, e.b) = draw_connected(dice, s);
  if (f == kSilence) e.amount = at_most(0.05, 4);
  if (f == kClockStep) e.amount = dice.between(0.01, 3);
  if (f == kSlowLink) e.a = draw_viewer(dice, s), e.amount = dice.between(1e4, 1e6);
  if (f == kSlowWork) e.a = draw_of(dice, Role::kSampler, s.samplers), e.amount = dice.between(2, 100);
  if (f == kDiskFull) e.amount = at_most(0.5, 3);
  if (f == kLeave) e.a = {Role::kSampler, s.samplers - 1};
  if (f == kLeave && dice.chance(0.5) && s.viewers > 1) e.a = {Role::kViewer, s.viewers - 1};
  if (f == kJoin) e.a = {dice.chance(0.5) ? Role::kViewer : Role::kSampler, 0};
  if (f == kStranger)
    e.a = {dice.chance(0.6) ? Role::kMaster : Role::kPacker, 0}, e.amount = double(1 + dice.below(40));
  if (f == kImpostor)
    e.b = {dice.pick<Role>({Role::kSampler, Role::kViewer, Role::kData}), 0}, e.amount = double(dice.below(2));
  if (f == kIntruder) e.a = {Role(1 + dice.below(4)), 0}, e.b = {Role((uint64_t(e.a.role) + 1 + dice.below(4)) % 5), 0};
  if (f == kShow) e.a = {Role::kData, 0}, e.amount = at_most(0.1, 1.5), e.show = Show(dice.below(size_t(Show::kMesh)));
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
  if (dice.chance(0.3)) w.errors = {.depth = dice.between(0, 0.5), .normal = 4, .colour = 8};
  if (dice.chance(0.3)) w.view_cell_m = 0;
  if (dice.chance(0.3)) w.still_rays = 1;
  if (dice.chance(0.15)) s.log_limit_mb = 1;
}

// Draws an event on the heels of another: a second order, a connection that breaks while the first is carried out, a
// peer that is quicker than those that come back.
void add_follower(Dice& dice, Scenario& s, double calm_at_s) {
  const Event first = s.events.back();
  const bool order = first.fault == Fault::kOrder, kill = first.fault == Fault::kKill;
  const double at_s = first.at_s + (dice.chance(0.4) ? 0.002 : dice.between(0, 0.4));
  const auto add = [&s](double at_s, Fault fault, Part a, Part b, double amount) {
    s.events.push_back({.at_s = at_s, .fault = fault, .a = a, .b = b, .amount = amount});
  };
  if (order && dice.chance(0.5)) return s.events.push_back(draw_order(dice, s, at_s));
  if (order) add(at_s, Fault::kBreak, draw_viewer(dice, s), {Role::kPacker, 0}, 0);
  if (kill && first.a.role == Role::kMaster)
    add(first.at_s + first.amount + 0.01, Fault::kImpostor, {}, {Role::kViewer, 0}, 1);
  for (int n = 0; n < s.samplers && kill && first.a.role == Role::kSampler; ++n)
    add(first.at_s, Fault::kKill, {Role::kSampler, n}, {}, std::min(first.amount, calm_at_s - first.at_s));
}

void add_events(Dice& dice, Scenario& s, double mean_apart_s) {
  const double calm_at_s = s.duration_s - s.calm_s;
  for (double at_s = dice.between(0, 2 * mean_apart_s); at_s < calm_at_s - kCalmBegins_s;
       at_s += dice.between(0, 2 * mean_apart_s)) {
    s.events.push_back(dice.chance(0.25) ? draw_order(dice, s, at_s)
                                         : draw_event(dice, s, at_s, calm_at_s - kCalmBegins_s / 2));
    if (dice.chance(0.4)) add_follower(dice, s, calm_at_s);
  }
  std::stable_sort(s.events.begin(), s.events.end(), [](const Event& a, const Event& b) { return a.at_s < b.at_s; });
}

}  // namespace

std::string text_of(Part part) { return fmt::format("{}-{}", kRoleNames[size_t(part.role)], part.number); }

std::string text_of(const Event& e) {
  const std::string_view more = e.fault == Fault::kShow ? kShowNames[size_t(e.show)] : std::string_view(e.order);
  return fmt::format("{:9.4f} {} {} {} {:.4g} {}", e.at_s, kFaultNames[size_t(e.fault)], text_of(e.a), text_of(e.b),
                     e.amount, more);
}

wire::Control order_of(const Event& e) {
  std::string_view rest = e.order;
  wire::Control out{.command = std::string(take_until(rest, '|')), .arguments = {}};
  while (!rest.empty()) {
    std::string_view argument = take_until(rest, '|');
    const auto name = take_until(argument, '=');
    out.arguments.emplace(name, argument);
  }
  return out;
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
  s.show = dice.chance(0.35)   ? dice.chance(0.6) ? Show::kBall : Show::kSeries
           : dice.chance(0.15) ? Show::kJulia
                               : Show(dice.below(3));
  s.data_servers = dice.chance(is_volume(s.show) ? 0.4 : 0.1) ? 2 : 1;
  s.samplers = 1 + int(dice.below(3));
  s.viewers = dice.chance(0.7) ? 1 : 2;
  s.one_machine = dice.chance(0.4);
  s.display_hz = dice.chance(0.3) ? 8 : 3;
  s.tile_size = dice.chance(0.25) ? 16 : dice.chance(0.5) ? 32 : 64;
  s.tile_s = dice.between(0.0005, 0.02);
  if (dice.chance(is_volume(s.show) ? 0.35 : 0.25))
    s.coupling = {viewer::CouplingMode::kSync, 1};
  else if (dice.chance(is_volume(s.show) ? 0.4 : 0.2))
    s.coupling = {viewer::CouplingMode::kLoose, 2 + int(dice.below(2))};
  s.keys = dice.chance(0.2);
  s.records = dice.chance(0.1);
  draw_links(dice, s);
  draw_settings(dice, s);
  if (!dice.chance(0.1)) add_events(dice, s, dice.between(0.3, 3));
  s.events.push_back({.at_s = s.duration_s - 0.5, .fault = Fault::kOrder, .a = {}, .b = {}, .order = "status"});
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
  std::erase_if(s.events, [](const Event& e) {
    return e.fault == Fault::kJoin || e.fault == Fault::kLeave || e.fault == Fault::kShow;
  });
  return s;
}

std::string text_of(const Scenario& s) {
  std::string out = fmt::format(
      "seed {}: {} of {} data servers for {:.1f} s, {} samplers, {} viewers at {} Hz, {}{}{}{}, steering {}, {:.0f} ms "
      "a tile, links "
      "{:.1f} "
      "ms, to viewers {:.1f} ms{}\n",
      s.seed, kShowNames[size_t(s.show)], s.data_servers, s.duration_s, s.samplers, s.viewers, s.display_hz,
      coupling_text(s.coupling), s.one_machine ? ", one machine" : "", s.keys ? ", keys" : "",
      s.records ? ", record" : "", s.settings.steering ? "on" : "off", s.tile_s * 1e3, s.links.latency_s * 1e3,
      s.to_viewers.latency_s * 1e3,
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
