#include "tools/lab/simulation/figures/figures.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "services/data/kinds.h"
#include "services/sampler/mesh/sampler.h"
#include "tools/lab/simulation/run.h"
#include "tools/lab/simulation/scenes/surface.h"

namespace telesplat::simulation {
namespace {

// ---- walks ----------------------------------------------------------------------------------------------------------

struct Stop {
  double t_s;
  glm::dvec3 eye, target;
};

// From stop to stop; it speeds up and slows down as t²(3 - 2t) does.
geometry::Trajectory walk_along(const std::vector<Stop>& stops) {
  constexpr int kSamples = 40;  // between two stops
  std::vector<geometry::Trajectory::Sample> samples;
  for (size_t i = 0; i + 1 < stops.size(); ++i)
    for (int n = 0; n < kSamples; ++n) {
      const Stop &a = stops[i], &b = stops[i + 1];
      const double t = double(n) / kSamples, u = t * t * (3 - 2 * t);
      samples.push_back({a.t_s + t * (b.t_s - a.t_s),
                         geometry::look_at(a.eye + u * (b.eye - a.eye), a.target + u * (b.target - a.target))});
    }
  const Stop& last = stops.back();
  samples.push_back({last.t_s, geometry::look_at(last.eye, last.target)});
  return geometry::Trajectory::of(std::move(samples));
}

const glm::dvec3 kFront{0, 0.25, 1.1};

geometry::Trajectory still() { return geometry::Trajectory::still(geometry::look_at(kFront, {})); }
// To the right, a rest, and on to the back.
geometry::Trajectory around() {
  const glm::dvec3 right{0.9, 0.35, 0.6}, back{0.7, 0.5, -0.6};
  return walk_along({{0, kFront, {}},
                     {1.5, kFront, {}},
                     {4, right, {0.1, 0, 0}},
                     {5, right, {0.1, 0, 0}},
                     {8, back, {-0.05, -0.05, 0}}});
}
// To the left and nearer.
geometry::Trajectory along() {
  return walk_along(
      {{0, {0.5, 0.3, 1}, {}}, {2, {0.5, 0.3, 1}, {}}, {5, {-0.6, 0.3, 0.8}, {}}, {8, {-0.4, 0.2, 0.6}, {}}});
}
geometry::Trajectory turning() {
  const glm::dvec3 left{-0.5, 0, 0}, right{0.5, 0.1, 0};
  return walk_along({{0, kFront, {}},
                     {1.5, kFront, {}},
                     {3, kFront, left},
                     {5, kFront, right},
                     {6.5, kFront, left},
                     {8, kFront, {}}});
}

Scenario plain(Show show, geometry::Trajectory head) {
  Scenario s{.seed = 50, .duration_s = 12, .calm_s = 4, .show = show};
  s.links = s.to_viewers = {.latency_s = 0.0002};
  s.heads = {std::move(head)};
  return s;
}

Scenario with(Scenario s, const std::function<void(Scenario&)>& change) {
  change(s);
  return s;
}

// The same where something goes wrong.
Scenario disturbed(Show show, geometry::Trajectory head, std::vector<Event> events) {
  Scenario s = plain(show, std::move(head));
  s.events = std::move(events);
  return s;
}

Scenario real(const char* file, geometry::Trajectory head) {
  Scenario s = plain(Show::kMesh, std::move(head));
  const char* set = std::getenv("TELESPLAT_DATA");
  const char* home = std::getenv("HOME");
  s.file = (set ? set : std::string(home ? home : "") + "/.cache/telesplat-data") + "/meshes/" + file;
  s.duration_s = 11, s.calm_s = 3;  // a head that stands looks again after a second, at finer points
  s.width = 96, s.height = 72, s.display_hz = 10;
  return s;
}

// ---- what is counted ------------------------------------------------------------------------------------------------

using Truth = std::function<image::View(const geometry::Camera&)>;

Result<Truth> truth_of(const Scenario& s) {
  if (const auto surface = surface_of(s.show))
    return Truth([surface](const geometry::Camera& c) { return render_surface(*surface, c, image::Shading({}, c)); });
  if (s.show != Show::kMesh) return Truth();
  data::MeshOptions options;
  options.use_cache = false;
  const auto store = data::open_mesh(s.file, options, {});
  if (!store) return store.error();
  std::shared_ptr<sampler::Sampler> sampler = sampler::make_ray_sampler(1);
  for (const auto& chunk : (*store)->leaves())
    if (const Status added = sampler->add_chunk(chunk.id, (*store)->chunk(chunk.id)); !added) return added.error();
  return Truth(
      [sampler](const geometry::Camera& c) { return sampler::render_directly(*sampler, c, image::Shading({}, c)); });
}

class Counter final : public Observer {
 public:
  explicit Counter(Truth truth) : truth_(std::move(truth)) {}

  void on_begin(Part part, int process, double now_s) override {
    if (part.role != Role::kViewer) return;
    viewers_[process] = {};
    if (part.number == 0) watched_ = process, begins_s_ = now_s;
  }
  void on_passed(const Passed& m) override {
    if (m.what == Passed::What::kSent && viewers_.count(m.from)) sent(m);
    if (m.what == Passed::What::kDelivered && viewers_.count(m.to)) delivered(m);
  }
  void on_frame(Part part, SimulatedViewer& viewer, const viewer::DrawnFrame&, double now_s) override {
    if (part.number != 0) return;
    last_ = viewer.view(), camera_ = viewer.camera();
    if (now_s < next_s_) return;
    next_s_ = double(int(now_s) + 1);
    look(seconds_);
  }

  WalkFigures figures(const Outcome& outcome, bool asynchronous) {
    Sum last;
    look(last);
    WalkFigures out{{"bytes", double(bytes_)},
                    {"first_bytes", double(first_bytes_)},
                    {"first_s", first_s_},
                    {"latency_ms", outcome.waited_s * 1e3 / double(std::max<uint64_t>(outcome.updates, 1))},
                    {"leases", double(outcome.leases)},
                    {"messages", double(outcome.messages)},
                    {"updates", double(outcome.updates)}};
    if (outcome.rays > 0) {
      out["rays"] = double(outcome.rays), out["points"] = double(outcome.points);
      if (asynchronous)
        out["digests_equal"] =
            std::all_of(viewers_.begin(), viewers_.end(), [](const auto& v) { return v.second > 0; });
    }
    if (truth_) {
      out["holes_percent"] = last.holes * 100, out["psnr_db"] = last.psnr_db;
      out["holes_walk_percent"] = seconds_.holes * 100 / seconds_.frames;
      out["psnr_walk_db"] = seconds_.psnr_db / seconds_.frames;
    }
    return out;
  }

 private:
  struct Sum {
    double holes = 0, psnr_db = 0;
    int frames = 0;
  };
  void look(Sum& sum) const {
    if (!truth_) return;
    geometry::Camera fine = camera_;
    fine.width *= kFine, fine.height *= kFine;
    const Compared c = compare(last_, truth_(fine));
    sum.holes += c.holes, sum.psnr_db += c.psnr_db, ++sum.frames;
  }
  void sent(const Passed& m) {
    if (m.type == wire::ViewRequest::kName && m.from == watched_) {
      if (const auto request = wire::decode<wire::ViewRequest>(m.body)) instance_ = request->viewer;
    } else if (m.type == wire::StatusReport::kName) {
      const auto status = wire::decode<wire::StatusReport>(m.body);
      if (!status || !status->values.count("digests_equal")) return;
      viewers_[m.from] = status->values.at("digests_different") > 0 ? -1 : status->values.at("digests_equal");
    }
  }
  void delivered(const Passed& m) {
    const bool slices = m.type == wire::SliceFrame::kName;
    if (m.kind != net::Kind::kPub && !slices) return;
    bytes_ += m.body.size();
    if (m.to != watched_ || first_s_ > 0) return;
    first_bytes_ += m.body.size();
    const auto patch = slices ? Result<wire::Patch>(Error{""}) : wire::decode<wire::Patch>(m.body);
    const bool complete = patch && patch->frame_complete && !patch->extra && patch->viewer == instance_;
    if (slices || (m.type == wire::Patch::kName && complete)) first_s_ = m.now_s - begins_s_;
  }

  const Truth truth_;
  std::map<int, double> viewers_;  // digests that were equal, by process; -1: one was not
  int watched_ = -1;
  InstanceId instance_;
  double begins_s_ = 0, first_s_ = 0, next_s_ = 0;
  uint64_t bytes_ = 0, first_bytes_ = 0;
  image::View last_;
  geometry::Camera camera_;
  Sum seconds_;
};

const FigureRule& rule_of(const std::string& figure) {
  return *std::find_if(std::begin(kFigureRules), std::end(kFigureRules),
                       [&](const auto& r) { return r.name == figure; });
}

}  // namespace

std::vector<Walk> standard_walks() {
  using enum Show;
  return {
      {"spheres-still", plain(kSpheres, still())},
      {"spheres-turning-head", plain(kSpheres, turning())},
      {"spheres-slow-link",
       with(plain(kSpheres, around()), [](Scenario& s) { s.to_viewers = {.latency_s = 0.02, .bytes_s = 1e6}; })},
      {"spheres-steering-off", with(plain(kSpheres, around()), [](Scenario& s) { s.settings.steering = false; })},
      {"terrain-walk", plain(kTerrain, around())},
      {"terrain-two-viewers",
       with(plain(kTerrain, around()), [](Scenario& s) { s.viewers = 2, s.heads.push_back(along()); })},
      {"terrain-sync", with(plain(kTerrain, along()),
                            [](Scenario& s) {
                              s.coupling = {viewer::CouplingMode::kSync, 1};
                            })},
      {"terrain-keep", with(plain(kTerrain, along()),
                            [](Scenario& s) { s.settings.steering = false, s.settings.keep_redundant = true; })},
      {"fence-walk", plain(kBars, along())},
      {"julia-walk", with(plain(kJulia, along()), [](Scenario& s) { s.display_hz = 10; })},
      {"ball-walk", with(plain(kBall, along()), [](Scenario& s) { s.display_hz = 10; })},
      {"terrain-small-tiles", with(plain(kTerrain, around()),
                                   [](Scenario& s) {
                                     s.tile_size = 16, s.samplers = 3, s.settings.max_points = 3000;
                                     s.settings.obsolete_after_s = 3;
                                   })},
      {"ball-slow-link",
       with(plain(kBall, along()),
            [](Scenario& s) { s.display_hz = 10, s.to_viewers = {.latency_s = 0.02, .bytes_s = 2e5}; })},
      {"spheres-sampler-stops", disturbed(kSpheres, around(), {{3, Fault::kStop, {Role::kSampler, 1}, {}, 3}})},
      {"terrain-samplers-die", disturbed(kTerrain, turning(),
                                         {{3, Fault::kKill, {Role::kSampler, 0}, {}, 1},
                                          {3.1, Fault::kKill, {Role::kSampler, 1}, {}, 1.5},
                                          {6, Fault::kLeave, {Role::kSampler, 1}, {}, 0}})},
      {"spheres-another-master", disturbed(kSpheres, along(), {{3, Fault::kKill, {Role::kMaster, 0}, {}, 0.5}})},
      {"spheres-epoch-on-a-slow-link",
       with(disturbed(kSpheres, turning(),
                      {{3.2, Fault::kOrder, {}, {}, 0, "epoch"}, {6, Fault::kOrder, {}, {}, 0, "epoch"}}),
            [](Scenario& s) { s.to_viewers = {.latency_s = 0.02, .bytes_s = 1e5}; })},
      {"ball-loose-with-breaks", with(disturbed(kBall, along(),
                                                {{3, Fault::kOrder, {}, {}, 0, "epoch"},
                                                 {3.05, Fault::kBreak, {Role::kViewer, 0}, {Role::kPacker, 0}, 0},
                                                 {5, Fault::kOrder, {}, {}, 0, "coupling|coupling=sync"},
                                                 {5.5, Fault::kBreak, {Role::kViewer, 0}, {Role::kPacker, 0}, 0}}),
                                      [](Scenario& s) {
                                        s.display_hz = 10, s.coupling = {viewer::CouplingMode::kLoose, 3};
                                      })},
      {"bone-walk", real("alderson-bone-718k.ply", around())},
      {"bone-turning-head", real("alderson-bone-718k.ply", turning())},
      {"bone-slow-link", with(real("alderson-bone-718k.ply", along()),
                              [](Scenario& s) { s.to_viewers = {.latency_s = 0.02, .bytes_s = 1e6}; })},
  };
}

bool has_data(const Walk& walk) { return walk.scenario.file.empty() || std::filesystem::exists(walk.scenario.file); }

Result<WalkResult> run_walk(const Walk& walk) {
  auto truth = truth_of(walk.scenario);
  if (!truth) return truth.error();
  Counter counter(*std::move(truth));
  WalkResult out;
  out.outcome = run_scenario(walk.scenario, {&counter});
  if (out.outcome.failure) return out;
  const bool asynchronous = walk.scenario.coupling.mode == viewer::CouplingMode::kAsync;  // else digests do not come
  for (const auto& [name, value] : counter.figures(out.outcome, asynchronous))
    out.figures[name] = std::stod(fmt::format("{:.{}f}", value, rule_of(name).digits));
  return out;
}

std::string json_of(const std::map<std::string, WalkFigures>& walks) {
  std::string out;
  for (const auto& [walk, figures] : walks) {
    std::string line;
    for (const auto& [name, value] : figures)
      line += fmt::format("{}\"{}\": {:.{}f}", line.empty() ? "" : ", ", name, value, rule_of(name).digits);
    out += fmt::format("{}\n\"{}\": {{{}}}", out.empty() ? "" : ",", walk, line);
  }
  return "{" + out + "\n}\n";
}

Comparison compare_figures(const std::string& walk, const WalkFigures& now, const WalkFigures& golden) {
  Comparison out;
  for (const FigureRule& rule : kFigureRules) {
    const auto is = now.find(rule.name), was = golden.find(rule.name);
    if (is == now.end() && was == golden.end()) continue;
    if (is == now.end() || was == golden.end()) {
      out.worse.push_back(fmt::format("{}: {} is {}", walk, rule.name, is == now.end() ? "missing" : "new"));
      continue;
    }
    const double more = (is->second - was->second) * (rule.more_is_better ? -1 : 1);
    const double most = rule.tolerance > 0 ? rule.tolerance + 1e-9 : 0.01 * was->second;
    if (std::abs(more) > most)
      (more > 0 ? out.worse : out.better)
          .push_back(fmt::format("{}: {} is {:.{}f}, golden {:.{}f}", walk, rule.name, is->second, rule.digits,
                                 was->second, rule.digits));
  }
  return out;
}

}  // namespace telesplat::simulation
