#include "tools/lab/simulation/checks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <limits>
#include <nlohmann/json.hpp>

#include "common/geometry/clip.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::simulation {
namespace {

constexpr double kAnswers_s = 1;    // a view, besides what its link and its samplers take
constexpr double kTakesOver_s = 2;  // another sampler, from one that fails: lease_timeout_s
constexpr double kLook_s = 0.1;
constexpr double kMostLateViews = 1.5;        // views whose rays a standing head casts at the end, at most
constexpr double kLeast_dB[] = {22, 27, 12};  // least PSNR of a standing head's picture: spheres, terrain, bars
constexpr double kMostForgets = 32e6;  // bytes of forgets that the log keeps beyond its limit, at most (event_log.h)
constexpr double kMostHoles = 0.02, kMostWrong = 0.05;  // shares of pixels that one surface covers whole
constexpr double kBehind_s = 2.5;  // events that were published earlier have arrived, and were told of

template <class M>
std::optional<M> read(const Passed& m) {
  if (m.type != M::kName) return std::nullopt;
  auto out = wire::decode<M>(m.body);
  return out ? std::optional<M>(*std::move(out)) : std::nullopt;
}

// FNV-1a over words.
void mix(uint64_t& digest, const void* data, size_t bytes) {
  const auto* at = static_cast<const uint8_t*>(data);
  for (; bytes >= 8; bytes -= 8, at += 8) {
    uint64_t word;
    std::memcpy(&word, at, 8);
    digest = (digest ^ word) * 0x100000001b3u;
    digest ^= digest >> 29;
  }
  for (; bytes > 0; --bytes, ++at) digest = (digest ^ *at) * 0x100000001b3u;
}

}  // namespace

Checks::Checks(const Scenario& scenario)
    : scenario_(scenario),
      excuses_(scenario_),
      orders_(scenario.duration_s, [this](const std::string& text) { fail("order", text, now_s_); }) {}

void Checks::fail(std::string_view check, const std::string& text, double now_s) {
  if (outcome_.failure) return;
  outcome_.failure = Failure{std::string(check), text, now_s};
  if (on_failure) on_failure();
}

Checks::Viewer* Checks::viewer_of(int process) {
  const auto found = viewers_.find(process);
  return found == viewers_.end() ? nullptr : &found->second;
}

bool Checks::is_newest_master(int process) const {
  for (auto p = parts_.rbegin(); p != parts_.rend(); ++p)
    if (p->second.role == Role::kMaster) return p->first == process;
  return false;
}

// ---- what passes ----------------------------------------------------------------------------------------------------

void Checks::on_passed(const Passed& m) {
  now_s_ = m.now_s;
  if (m.what == Passed::What::kDelivered) {
    digest(m);
    delivered(m);
  } else if (m.what == Passed::What::kSent) {
    sent(m);
  }
  if (!rests_ && m.now_s - looked_s_ >= kLook_s) looked_s_ = m.now_s, look_at_requests(m.now_s);
}

void Checks::digest(const Passed& m) {
  ++outcome_.messages;
  mix(outcome_.digest, &m.now_s, sizeof m.now_s);
  const int32_t ends[2] = {m.from, m.to};
  mix(outcome_.digest, ends, sizeof ends);
  mix(outcome_.digest, m.type.data(), m.type.size());
  mix(outcome_.digest, m.body.data(), m.body.size());
}

void Checks::digest(const viewer::DrawnFrame& drawn, const image::View& view) {
  const uint64_t ids[2] = {drawn.update.request.value, drawn.epoch.value};
  mix(outcome_.digest, ids, sizeof ids);
  mix(outcome_.digest, view.colour.data(), view.colour.size() * sizeof(uint32_t));
  mix(outcome_.digest, view.depth_m.data(), view.depth_m.size() * sizeof(float));
}

void Checks::sent(const Passed& m) {
  const auto from = parts_.find(m.from);
  if (from == parts_.end()) {  // a peer without a part
    if (const auto order = read<wire::Control>(m)) orders_.on_order(m.from, *order, m.now_s);
    return;
  }
  const Part part = from->second;
  if (m.type == wire::StatusReport::kName) return on_status(m, part);
  if (part.role == Role::kViewer) {
    if (const auto request = read<wire::ViewRequest>(m)) {
      Viewer& v = viewers_.at(m.from);
      v.instance = request->viewer;
      v.open.emplace(request->request.value, m.now_s);
      if (!v.open_since_s) v.open_since_s = m.now_s;
    } else if (const auto rows = read<wire::MetricRows>(m); rows && rows->table == "updates") {
      on_updates(*rows, part);
    }
  } else if (part.role == Role::kMaster) {
    if (const auto lease = read<wire::Lease>(m)) on_lease(*lease);
    if (const auto slab = read<wire::SliceLease>(m))
      leases_[slab->lease.value] = {slab->frame.value, slab->slab}, ++outcome_.leases;
    if (const auto welcome = read<wire::Welcome>(m)) orders_.on_welcome(*welcome, m.sent_s);
  } else if (part.role == Role::kPacker) {
    if (m.kind == net::Kind::kPub) on_patch(m, part);
    if (const auto done = read<wire::TileDone>(m)) on_done(*done, m.now_s);
  }
}

void Checks::on_updates(const wire::MetricRows& rows, Part part) {
  const size_t width = rows.columns.size();
  const size_t request = size_t(std::find(rows.columns.begin(), rows.columns.end(), "request") - rows.columns.begin());
  for (size_t at = request; request < width && at < rows.values.size(); at += width)
    if (!updates_.emplace(rows.instance.value, uint64_t(rows.values[at])).second)
      fail("twice", fmt::format("{} tells of update {} twice", text_of(part), rows.values[at]), now_s_);
}

void Checks::on_lease(const wire::Lease& lease) {
  leases_[lease.lease.value] = {lease.frame.value, lease.tile};
  ++outcome_.leases;
  outcome_.rays += lease.rays > 0 ? lease.rays : uint64_t(lease.rect.width) * uint64_t(lease.rect.height);
  if (now_s_ > scenario_.duration_s - OrderChecks::kLast_s)
    late_rays_ += lease.rays > 0 ? lease.rays : uint64_t(lease.rect.width) * uint64_t(lease.rect.height);
}

void Checks::on_done(const wire::TileDone& done, double now_s) {
  if (!packer_welcomed_) return;  // it has not heard of this master yet
  const auto lease = leases_.find(done.lease.value);
  if (lease == leases_.end() || lease->second != std::pair(done.frame.value, done.tile))
    fail("lease",
         fmt::format("tile {} of frame {} is done by lease {}, which this master did not give", done.tile,
                     done.frame.value, done.lease.value),
         now_s);
}

void Checks::note_sequence(uint64_t sequence, double now_s) {
  sequences_.emplace_back(now_s, sequence);
  while (sequences_.size() > 1 && sequences_[1].first < now_s - kBehind_s) sequences_.pop_front();
}

void Checks::on_patch(const Passed& m, Part) {
  outcome_.bytes += m.body.size();
  if (const auto mark = read<wire::StateMark>(m)) {
    note_sequence(mark->sequence.value, m.now_s);
    outcome_.points = mark->points;
    if (const double most = double(scenario_.settings.max_points); most > 0 && mark->points > most * 1.5 + 2000)
      fail("limit", fmt::format("the model has {} points, limit {}", mark->points, most), m.now_s);
    return;
  }
  const auto patch = read<wire::Patch>(m);
  if (!patch) return;
  note_sequence(patch->sequence.value, m.now_s);
  if (patch->image.empty()) return;
  if (++published_[{patch->frame.value, patch->tile * 64 + patch->step}] > 1 && patch->counts.kept > 0)
    fail("twice", fmt::format("tile {} of frame {} is published twice", patch->tile, patch->frame.value), m.now_s);
}

void Checks::delivered(const Passed& m) {
  if (Viewer* v = viewer_of(m.to)) {
    if (const auto patch = read<wire::Patch>(m)) {
      if (patch->frame_complete && !patch->extra && patch->viewer == v->instance)
        answered(m.to, patch->viewer, patch->request, m.now_s);
    } else if (const auto frame = read<wire::SliceFrame>(m); frame && frame->viewer == v->instance) {
      answered(m.to, frame->viewer, frame->request, m.now_s);
    }
  }
  const auto to = parts_.find(m.to);
  if (m.type == wire::Welcome::kName && is_newest_master(m.from) && to != parts_.end() &&
      to->second.role == Role::kPacker)
    packer_welcomed_ = true;
  if (const auto reply = read<wire::ControlReply>(m)) orders_.on_reply(m.to, *reply, m.sent_s, now_s_);
  if (intruders_.contains(m.to) && m.type != wire::Shutdown::kName)
    fail("intruder", fmt::format("a process without a right to it is sent {}", m.type), m.now_s);
  const auto rows = read<wire::MetricRows>(m);
  if (rows && rows->table == "updates" && !rows->columns.empty()) rows_ += rows->values.size() / rows->columns.size();
}

void Checks::answered(int process, InstanceId, RequestId request, double now_s) {
  Viewer& v = viewers_.at(process);
  ++outcome_.updates;
  if (const auto asked = v.open.find(request.value); asked != v.open.end()) outcome_.waited_s += now_s - asked->second;
  v.open.erase(v.open.begin(), v.open.upper_bound(request.value));
  v.open_since_s = v.open.empty() ? std::nullopt : std::optional(now_s);
}

void Checks::look_at_requests(double now_s) {
  const double tiles = 1.3 * 1.3 * scenario_.width * scenario_.height / (scenario_.tile_size * scenario_.tile_size) + 2;
  double most_s = kAnswers_s + 6 * scenario_.to_viewers.latency_s + 3 * tiles * scenario_.tile_s;
  if (scenario_.to_viewers.bytes_s > 0) most_s += 3e5 / scenario_.to_viewers.bytes_s;
  for (const auto& [process, v] : viewers_)
    if (v.open_since_s &&
        now_s - *v.open_since_s > most_s + (excuses_.delayed(*v.open_since_s, now_s) ? kTakesOver_s : 0) &&
        !excuses_.disturbed(*v.open_since_s, now_s))
      fail("request",
           fmt::format("{} has had no answer for {:.1f} s, requests from {} on are open", text_of(parts_.at(process)),
                       now_s - *v.open_since_s, v.open.begin()->first),
           now_s);
  orders_.look_at_open(now_s, excuses_);
  const uint64_t due = orders_.due_epoch(now_s, excuses_);
  for (const auto& [process, v] : viewers_)
    if (v.pictured && v.epoch < due)
      fail("order", fmt::format("{} shows epoch {}, not {}", text_of(parts_.at(process)), v.epoch, due), now_s);
}

void Checks::on_status(const Passed& m, Part part) {
  const auto status = read<wire::StatusReport>(m);
  if (!status || status->values.empty()) return;
  const auto value = [&](const char* name) {
    const auto found = status->values.find(name);
    return found == status->values.end() ? 0 : found->second;
  };
  if (part.role == Role::kPacker) packer_ = status->values;
  if (part.role != Role::kViewer) return;
  Viewer& v = viewers_.at(m.from);
  v.status = status->values;
  if (value("digests_different") > 0)
    fail("replica", fmt::format("the points of {} are not the packer's", text_of(part)), m.now_s);
  if (v.digests_equal_at_calm < 0 && m.now_s > scenario_.duration_s - scenario_.calm_s)
    v.digests_equal_at_calm = value("digests_equal");
}

// ---- what happens ---------------------------------------------------------------------------------------------------

void Checks::on_event(const Event& e) { orders_.on_event(e); }

void Checks::on_begin(Part part, int process, double) {
  if (part.number >= kFirstIntruder) {
    intruder_keys_.insert(text_of(part));
    return void(intruders_.insert(process));
  }
  parts_[process] = part;
  if (part.role == Role::kViewer) viewers_[process].process = process;
  if (part.role == Role::kMaster) {
    leases_.clear();
    packer_welcomed_ = false;
    orders_.on_new_master();
    for (auto& [number, v] : viewers_) v.another_master = true;
  }
  if (part.role == Role::kMaster || part.role == Role::kPacker) published_.clear();
}

void Checks::on_end(Part part, int process, double, const std::string&) {
  if (part.role == Role::kViewer) viewers_.erase(process);
  intruders_.erase(process);
}

void Checks::on_unexpected(Part part, const std::string& what, double now_s) {
  fail("exit", fmt::format("{}: {}", text_of(part), what), now_s);
}

// Clients of strangers aside, all here say what others expect. What comes faster than a limit allows is refused, too.
void Checks::on_rejected(Part part, std::string_view socket, const net::Message& message, const std::string& why) {
  // A process that has not heard of another scene yet asks for content of the former one.
  if (has_strangers() || excuses_.changes_show(now_s_) || intruder_keys_.contains(message.user)) return;
  fail("rejected", fmt::format("{} refuses {} at {}: {}", text_of(part), message.type, socket, why), now_s_);
}

void Checks::on_frame(Part part, SimulatedViewer& viewer, const viewer::DrawnFrame& drawn, double now_s) {
  ++outcome_.frames;
  digest(drawn, viewer.view());
  const auto found = std::find_if(viewers_.begin(), viewers_.end(),
                                  [&](const auto& v) { return v.second.instance == viewer.instance(); });
  if (found == viewers_.end()) return;
  Viewer& v = found->second;
  if (drawn.update.request.value > 0 && drawn.update.request.value < v.shown)
    fail("backwards", fmt::format("{} shows update {} after {}", text_of(part), drawn.update.request.value, v.shown),
         now_s);
  v.shown = std::max(v.shown, drawn.update.request.value);
  // Another master counts from 1 again.
  if (drawn.epoch.value < v.epoch && !std::exchange(v.another_master, false))
    fail("backwards", fmt::format("{} shows epoch {} after {}", text_of(part), drawn.epoch.value, v.epoch), now_s);
  v.epoch = drawn.epoch.value;
  if (drawn.empty && drawn.cached == 0 && v.pictured && !orders_.reshaped())
    fail("blank", fmt::format("{} has no picture any more", text_of(part)), now_s);
  v.pictured = v.pictured || !drawn.empty;
}

// ---- at the end -----------------------------------------------------------------------------------------------------

void Checks::at_rest(Session& session) {
  rests_ = true;
  const double now_s = session.now_s();
  outcome_.turns = session.turns();
  for (auto& [process, v] : viewers_) {
    const std::string name = text_of(parts_.at(process));
    if (!v.pictured) {
      fail("request", name + " has no picture at the end of the calm", now_s);
      continue;
    }
    const uint64_t had = sequences_.empty() || is_volume(session.show()) ? 0 : sequences_.front().second;
    if (v.status["sequence"] < double(had))
      fail("behind", fmt::format("{} has events up to {} of {}", name, v.status["sequence"], had), now_s);
    if (surface_of(session.show()) && v.status["buffers"] == 0 &&
        !(v.status["digests_equal"] > v.digests_equal_at_calm))
      fail("replica", fmt::format("no digest of {} was compared in the calm", name), now_s);
  }
  if (packer_["log_bytes"] > scenario_.log_limit_mb * 1.1e6 + kMostForgets)
    fail("limit", fmt::format("the packer's log has {} bytes", packer_["log_bytes"]), now_s);
  const std::string kind = fact_of(orders_.session(), "kind");
  const std::string scene = kind == "julia" ? kind : fact_of(orders_.session(), "scene");
  if (session.show() != Show::kMesh && scene != kShowNames[size_t(session.show())])
    fail("scene", fmt::format("the session shows \"{}\"", scene), now_s);
  if (!intruders_.empty()) fail("intruder", "a process whose key is not of its role goes on", now_s);
  if (!has_strangers()) {
    orders_.look_at_values();
    for (const auto& [process, v] : viewers_) {
      SimulatedViewer* const viewer = session.viewer(parts_.at(process).number);
      if (const auto known = viewer ? viewer->session() : nullptr)
        orders_.look_at_values(*known, text_of(parts_.at(process)));
    }
    look_at_status(session);
  }
  look_at_late_rays(session);
  compare_pictures(session);
}

// Where displays wait for updates, heads stand later.
void Checks::look_at_late_rays(const Session& session) {
  const bool waits =
      std::any_of(viewers_.begin(), viewers_.end(), [](const auto& v) { return v.second.status.at("coupling") != 0; });
  const double views = double(late_rays_) / double(scenario_.width * scenario_.height);
  const bool forgets = scenario_.settings.obsolete_after_s > 0;  // looks from beside, which come again
  if (scenario_.settings.steering && !waits && !forgets && !orders_.reshaped() &&
      views > kMostLateViews * double(viewers_.size()))
    fail("standing", fmt::format("rays of {:.1f} views are cast for {} heads that stand", views, viewers_.size()),
         session.now_s());
}

// The master's last status names the processes that run.
void Checks::look_at_status(const Session& session) {
  const auto status = nlohmann::json::parse(orders_.status(), nullptr, false);
  if (!status.is_object()) return;
  std::map<std::string, int> alive;
  for (const auto& p : status["processes"]) alive[p["role"]] += p["alive"].get<bool>();
  for (const Role role : {Role::kData, Role::kPacker, Role::kSampler, Role::kViewer}) {
    const std::string name(kRoleNames[size_t(role)]);
    if (alive[name] != session.count(role))
      fail("order", fmt::format("status has {} of the role {}, {} run", alive[name], name, session.count(role)),
           session.now_s());
    if (const std::string lacks = status["lacks"]; session.count(role) > 0 && lacks.find(name) != std::string::npos)
      fail("order", fmt::format("status lacks {}, {} run", lacks, session.count(role)), session.now_s());
  }
}

namespace {

constexpr double kAlike = 8, kUnlike = 64;  // differences of colours, of 255

// True if one surface covers the whole pixel; nearest and farthest: its depths there, m.
bool is_whole(const image::View& truth, int x, int y, float& nearest, float& farthest) {
  nearest = std::numeric_limits<float>::infinity(), farthest = 0;
  for (int n = 0; n < kFine * kFine; ++n) {
    const size_t at = size_t(kFine * y + n / kFine) * size_t(truth.width) + size_t(kFine * x + n % kFine);
    nearest = std::min(nearest, truth.depth_m[at]), farthest = std::max(farthest, truth.depth_m[at]);
  }
  return std::isfinite(farthest) && farthest <= 1.05f * nearest;
}

// The truth's mean colour there.
glm::dvec3 colour_of(const image::View& truth, int x, int y) {
  glm::dvec3 out(0);
  for (int n = 0; n < kFine * kFine; ++n) {
    const size_t at = size_t(kFine * y + n / kFine) * size_t(truth.width) + size_t(kFine * x + n % kFine);
    for (int c = 0; c < 3; ++c) out[c] += double(truth.colour[at] >> 8 * c & 255) / (kFine * kFine);
  }
  return out;
}
glm::dvec3 channels(uint32_t colour) {
  return {double(colour & 255), double(colour >> 8 & 255), double(colour >> 16 & 255)};
}
double largest(const glm::dvec3& v) { return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)}); }

}  // namespace

// Looks for holes at pixels that one surface covers whole, and their neighbours, too: silhouettes are a matter of how
// splats are drawn.
Compared compare(const image::View& view, const image::View& truth) {
  uint64_t whole = 0, holes = 0, wrong = 0;
  double squares = 0;
  const glm::dvec3 background = channels(image::ShadingParameters{}.background);
  const auto inside = [&](int x, int y) {
    float nearest = 0, farthest = 0;
    for (int n = 0; n < 9; ++n) {
      const int at_x = x + n % 3 - 1, at_y = y + n / 3 - 1;
      if (at_x < 0 || at_y < 0 || at_x >= view.width || at_y >= view.height) return false;
      if (!is_whole(truth, at_x, at_y, nearest, farthest)) return false;
    }
    return true;
  };
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      const glm::dvec3 wanted = colour_of(truth, x, y);
      const glm::dvec3 seen = channels(view.colour[size_t(y) * size_t(view.width) + size_t(x)]);
      squares += glm::dot(seen - wanted, seen - wanted);
      if (!inside(x, y) || largest(wanted - background) < 2 * kAlike) continue;
      ++whole;
      if (largest(seen - background) < kAlike)
        ++holes;
      else if (largest(seen - wanted) > kUnlike)
        ++wrong;
    }
  const double of = double(std::max<uint64_t>(whole, 1));
  const double mean = squares / (3 * double(view.colour.size()));
  return {double(holes) / of, double(wrong) / of, mean > 0 ? 10 * std::log10(255.0 * 255 / mean) : 99, whole};
}

// Holes and errors of the last frames, against the truth.
void Checks::compare_pictures(Session& session) {
  const auto surface = surface_of(session.show());
  const auto clip = geometry::clip_from_text(fact_of(orders_.session(), scene::kClipFact));
  outcome_.holes = outcome_.psnr_db = -1;
  // A surface that comes back after other data is sampled as the mesh of its chunks, which is not the surface.
  const bool changed = std::any_of(scenario_.events.begin(), scenario_.events.end(),
                                   [](const Event& e) { return e.fault == Fault::kShow && !surface_of(e.show); });
  if (!surface || !clip || changed) return;
  for (int n = 0; n < 6; ++n) {
    SimulatedViewer* const v = session.viewer(n);
    if (!v || v->view().colour.empty()) continue;
    geometry::Camera fine = v->camera();
    fine.width *= kFine, fine.height *= kFine;
    const auto truth = render_surface(*surface, fine, image::Shading({}, fine), *clip);
    const Compared c = compare(v->view(), truth);
    if (n == 0) outcome_.holes = c.holes, outcome_.psnr_db = c.psnr_db;
    const double most = (session.show() == Show::kBars ? 4 : clip->empty() ? 1 : 2) * kMostHoles;  // edges of a cut
    if (scenario_.settings.steering && c.whole > 60 &&
        (c.holes > most || c.wrong > kMostWrong || c.psnr_db < kLeast_dB[size_t(session.show())]))
      fail("standing",
           fmt::format("viewer-{} of {} sees {:.1f} % holes, {:.1f} % in another colour, and {:.1f} dB after the calm",
                       n, kShowNames[size_t(session.show())], c.holes * 100, c.wrong * 100, c.psnr_db),
           session.now_s());
  }
}

// Rows that came are in the record, each once. The record counts rows as lost that come from a viewer that the master
// does not know at that moment: sessions with such faults are left out.
void Checks::at_end(const std::string& folder, double now_s) {
  const bool whole = std::none_of(scenario_.events.begin(), scenario_.events.end(), [](const Event& e) {
    return e.fault != Fault::kOrder && e.fault != Fault::kSlowWork && e.fault != Fault::kSlowLink;
  });
  if (folder.empty() || outcome_.failure || !whole) return;
  std::ifstream file(folder + "/updates.csv");
  std::set<std::string> rows;
  uint64_t count = 0;
  std::string line;
  for (std::getline(file, line); std::getline(file, line); ++count) rows.insert(line);
  if (rows.size() != count || count != rows_)
    fail("record",
         fmt::format("{} rows of updates came, {} are in the record, {} of them different", rows_, count, rows.size()),
         now_s);
}

}  // namespace telesplat::simulation
