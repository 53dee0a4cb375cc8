#include "services/data/julia/served_julia.h"

#include <fmt/format.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "common/core/clock.h"
#include "common/julia/distance.h"
#include "common/options/table.h"
#include "common/scene/placement.h"
#include "common/scene/probe.h"
#include "services/data/base/epochs.h"

namespace telesplat::data {
namespace {

constexpr double kQuiet_s = 2;  // longer work reports its progress

// Returns the ray's first place whose orbit does not escape, between two places a millionth of the box apart. Steps are
// half of the estimated distance, as estimates near thin parts are too large (distance.h). nullopt: no such place
// within kMost steps.
std::optional<scene::Probed> cast(const julia::Parameters& parameters, const julia::Placement& placement,
                                  const geometry::Clip& clip, const scene::Probe& probe) {
  constexpr int kMost = 200'000;
  const geometry::DBox box{glm::dvec3(placement.box_room.lo), glm::dvec3(placement.box_room.hi)};
  const auto kept =
      clip.stretch(probe.origin_room, probe.direction_room).within(box, probe.origin_room, probe.direction_room);
  const double least_m = 1e-6 * glm::length(box.size());
  const julia::Slice slice = julia::slice(parameters);
  double at = std::max(kept.begin, 0.0);
  for (int n = 0; n < kMost && at <= kept.end; ++n) {
    const glm::dvec3 room = probe.origin_room + at * probe.direction_room;
    const double distance =
        julia::distance_estimate(parameters, slice, room / placement.scale + placement.centre) * placement.scale;
    if (distance <= 0) return scene::Probed{.room = room, .error_m = least_m};
    at += std::max(distance / 2, least_m);
  }
  return std::nullopt;
}

class ServedJulia final : public Served {
 public:
  ServedJulia(julia::Scene scene, const julia::Placement& placement, double room_size_m)
      : scene_(std::move(scene)), placement_(placement), room_size_m_(room_size_m) {}

  scene::Kind kind() const override { return scene::Kind::kJulia; }
  std::string title() const override { return scene_.title; }
  std::string summary() const override {
    const auto& c = scene_.parameters.c;
    return fmt::format("c = ({}, {}, {}, {}), {} iterations, {:.3f} units a metre", c.x, c.y, c.z, c.w,
                       scene_.parameters.iterations, 1 / placement_.scale);
  }
  void describe(wire::Hello& hello) const override {
    if (!scene_.timeline.empty()) hello.facts["animate"] = scene_.timeline.text();
    hello.parameters = julia::to_map(scene_.parameters);
    hello.parameters.merge(julia::to_map(placement_));
    hello.box_room = placement_.box_room;
    const glm::dvec3 lo(placement_.box_room.lo), hi(placement_.box_room.hi);
    scene::Placement placement{
        .data_to_room = glm::dmat4(glm::dmat3(placement_.scale)),
        .box_data = {lo / placement_.scale + placement_.centre, hi / placement_.scale + placement_.centre},
        .unit = {}};
    placement.data_to_room[3] = glm::dvec4(-placement_.centre * placement_.scale, 1);
    hello.facts[scene::kPlacementFact] = scene::to_text(placement);
  }
  Status follow(const wire::Welcome& session) override {
    epochs_.keep(session);
    return ok_status();
  }
  Result<std::optional<std::string>> carry_out(const wire::Order& order) override {
    if (order.command != "probe") return Served::carry_out(order);
    const auto probe = scene::probe_from(order.arguments);
    if (!probe) return probe.error();
    const Epochs::Scene* shown = epochs_.find(probe->epoch);
    if (!shown) return Error{"probe: that epoch is over"};
    const auto parameters = julia::from_map(shown->parameters);
    if (!parameters) return parameters.error();
    const auto found = cast(*parameters, placement_, shown->clip, *probe);
    if (!found) return Error{"probe: the ray does not meet the set"};
    return std::optional(scene::to_text(*found));
  }
  std::string record() const override {
    std::string out = fmt::format("\n[scene]\nkind = \"{}\"\ntitle = {}\nroom_size = {}\n", scene::name_of(kind()),
                                  options::quoted(scene_.title), room_size_m_);
    if (!scene_.timeline.empty()) out += fmt::format("animate = {}\n", options::quoted(scene_.timeline.text()));
    out += "\n[julia]\n";
    for (const auto& [name, value] : julia::to_map(scene_.parameters)) out += fmt::format("\"{}\" = {}\n", name, value);
    out += "\n[placement]\n";
    for (const auto& [name, value] : julia::to_map(placement_)) out += fmt::format("\"{}\" = {}\n", name, value);
    const auto& [lo, hi] = placement_.box_room;
    return out + fmt::format("lo = [{}, {}, {}]\nhi = [{}, {}, {}]\n", lo.x, lo.y, lo.z, hi.x, hi.y, hi.z);
  }

 private:
  const julia::Scene scene_;
  const julia::Placement placement_;
  const double room_size_m_;
  Epochs epochs_;
};

}  // namespace

Result<std::unique_ptr<Served>> serve_julia(const julia::SceneOptions& options, double room_size_m,
                                            const Progress& progress) {
  auto scene = julia::read_scene(options);
  if (!scene) return scene.error();
  const double begin_s = monotonic_s();
  const auto placement = julia::place(*scene, room_size_m, [&](size_t done, size_t of) {
    if (monotonic_s() - begin_s >= kQuiet_s) progress("looking for the set", double(done) / double(of));
  });
  if (!placement) return placement.error();
  return std::unique_ptr<Served>(std::make_unique<ServedJulia>(std::move(*scene), *placement, room_size_m));
}

}  // namespace telesplat::data
