#include "tools/lab/simulation/chart.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::simulation {
namespace {

constexpr size_t kWidth = 11;

// Returns the fields that tell one message from the next of its type.
struct Summary {
  std::string text;
  void operator()(const char* name, const auto& value, size_t = 0) {
    constexpr std::string_view kTold[] = {"request", "frame", "tile",           "lease", "sequence",
                                          "after",   "epoch", "command",        "role",  "ok",
                                          "why",     "extra", "frame_complete", "rays",  "kept"};
    if (std::find(std::begin(kTold), std::end(kTold), name) == std::end(kTold)) return;
    using V = std::decay_t<decltype(value)>;
    if constexpr (requires { value.value; })
      text += fmt::format(" {} {}", name, value.value);
    else if constexpr (std::is_same_v<V, bool>)
      text += value ? fmt::format(" {}", name) : "";
    else if constexpr (std::is_integral_v<V> || std::is_same_v<V, std::string>)
      text += fmt::format(" {} {}", name, value);
    else if constexpr (requires {
                         value.frame.value;
                         value.lease.value;
                         value.tile;
                       })
      text += fmt::format(" frame {} tile {} lease {}", value.frame.value, value.tile, value.lease.value);
  }
};

template <class... M>
std::string summary(const Passed& m) {
  Summary out;
  const auto look = [&]<class T>(std::type_identity<T>) {
    if (m.type != T::kName) return false;
    if (auto decoded = wire::decode<T>(m.body)) T::fields(out, *decoded);
    return true;
  };
  (void)(look(std::type_identity<M>{}) || ...);
  return std::string(m.type) + out.text;
}

std::string summary_of(const Passed& m) {
  using namespace wire;
  return summary<Hello, Welcome, Control, ControlReply, Order, OrderAnswer, Shutdown, ViewRequest, Lease, TileDone,
                 TileRefused, PlanRequest, Plan, FrameEnd, DepthTile, Patch, Forget, Refine, EpochBegin, StateMark,
                 StateRequest, StateBegin, SliceLease, SliceImages, SliceFrame, SliceAck>(m);
}

bool comes_by_time(std::string_view type) {
  using namespace wire;
  return type == StatusReport::kName || type == ClockRequest::kName || type == ClockReply::kName ||
         type == MetricRows::kName || type == Receipt::kName || type == LinkReport::kName ||
         type == LeaseRequest::kName || type == AccessReport::kName;
}

}  // namespace

int Chart::lane(Part part) {
  const auto found = std::find(parts_.begin(), parts_.end(), part);
  if (found != parts_.end()) return int(found - parts_.begin());
  parts_.push_back(part);
  return int(parts_.size()) - 1;
}

void Chart::on_begin(Part part, int process, double now_s) {
  lanes_[process] = lane(part);
  if (shown(now_s)) lines_.push_back({now_s, lanes_[process], -1, false, "begins"});
}

void Chart::on_end(Part, int process, double now_s, const std::string& how) {
  if (shown(now_s)) lines_.push_back({now_s, lanes_[process], -1, false, how});
}

void Chart::on_event(const Event& event) {
  if (shown(event.at_s)) lines_.push_back({event.at_s, -1, -1, false, text_of(event)});
}

void Chart::on_passed(const Passed& m) {
  if (m.what == Passed::What::kSent || !shown(m.now_s) || (!all_ && comes_by_time(m.type))) return;
  const auto of = [&](int process) {
    const auto found = lanes_.find(process);
    return found == lanes_.end() ? -1 : found->second;
  };
  const std::string text = m.body.empty() ? std::string(m.type) : summary_of(m);
  lines_.push_back({m.now_s, of(m.from), of(m.to), m.what == Passed::What::kDropped, text});
}

std::string Chart::text() const {
  const auto middle = [](int lane) { return size_t(lane) * kWidth + kWidth / 2; };
  std::string names = fmt::format("{:>9}  ", "s");
  for (const Part& part : parts_) names += fmt::format("{:^{}}", text_of(part), kWidth);
  std::string out;
  for (size_t n = 0; n < lines_.size(); ++n) {
    if (n % 50 == 0) out += names + "\n";
    const Line& line = lines_[n];
    std::string lanes(parts_.size() * kWidth, ' ');
    for (size_t i = 0; i < parts_.size(); ++i) lanes[middle(int(i))] = '|';
    if (line.from >= 0 && line.to >= 0 && line.from != line.to) {
      const size_t from = middle(line.from), to = middle(line.to), low = std::min(from, to), high = std::max(from, to);
      std::fill(lanes.begin() + long(low), lanes.begin() + long(high), '-');
      lanes[from] = '+';
      lanes[to] = line.lost ? 'x' : to > from ? '>' : '<';
    } else if (line.from >= 0) {
      lanes[middle(line.from)] = line.to < 0 && line.lost ? 'x' : '*';
    }
    out += fmt::format("{:9.4f}  {} {}{}\n", line.at_s, lanes, line.text, line.lost ? " LOST" : "");
  }
  return out;
}

}  // namespace telesplat::simulation
