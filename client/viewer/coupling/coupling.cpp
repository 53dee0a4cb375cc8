#include "client/viewer/coupling/coupling.h"

#include <fmt/format.h>

#include <utility>

#include "common/core/check.h"

namespace telesplat::viewer {

std::optional<CouplingMode> coupling_named(std::string_view name) {
  for (const auto mode : {CouplingMode::kAsync, CouplingMode::kSync, CouplingMode::kLoose, CouplingMode::kImages})
    if (name == coupling_name(mode)) return mode;
  return std::nullopt;
}

const char* coupling_name(CouplingMode mode) {
  constexpr const char* kNames[] = {"async", "sync", "loose", "images"};
  return kNames[size_t(mode)];
}

int buffers_of(CouplingMode mode, int loose) {
  if (mode == CouplingMode::kImages) return PipelineDepth::kFirst;
  return mode == CouplingMode::kAsync ? 0 : mode == CouplingMode::kSync ? 1 : loose;
}

CouplingState coupling_state(CouplingMode mode, int loose) { return {mode, buffers_of(mode, loose)}; }

std::string coupling_text(const CouplingState& s) {
  if (s.mode != CouplingMode::kLoose) return coupling_name(s.mode);
  return fmt::format("loose, {} buffer{}", s.buffers, s.buffers == 1 ? "" : "s");
}

std::optional<CouplingState> coupling_told(wire::CouplingOrder order, uint64_t buffers) {
  switch (order) {
    case wire::CouplingOrder::kOwn:
      return std::nullopt;
    case wire::CouplingOrder::kAsync:
      return coupling_state(CouplingMode::kAsync, 0);
    case wire::CouplingOrder::kSync:
      return coupling_state(CouplingMode::kSync, 0);
    case wire::CouplingOrder::kLoose:
      break;
  }
  return coupling_state(CouplingMode::kLoose, int(buffers));
}

void Coupling::set_buffers(int buffers) {
  buffers_ = buffers;
  if (waits()) return;
  open_.clear();
  ready_.clear();
}

void Coupling::asked(RequestId request, double now_s) {
  if (!waits()) return;
  CHECK(open_.empty() || open_.back().request < request);
  if (open_.empty()) heard_s_ = now_s;
  open_.push_back({request});
}

bool Coupling::is_open(RequestId request) const {
  return std::any_of(open_.begin(), open_.end(), [&](const Open& o) { return o.request == request && !o.complete; });
}

void Coupling::skip_before(RequestId request) {
  if (is_open(request)) std::erase_if(open_, [&](const Open& o) { return o.request < request && !o.complete; });
}

std::vector<RequestId> Coupling::release() {
  std::vector<RequestId> out;
  for (; !open_.empty() && open_.front().complete; open_.pop_front()) out.push_back(open_.front().request);
  ready_.insert(ready_.end(), out.begin(), out.end());
  return out;
}

std::vector<RequestId> Coupling::completed(RequestId request, double now_s) {
  progress(now_s);
  const auto found = std::ranges::find(open_, request, &Open::request);
  if (found != open_.end()) found->complete = true;
  if (newest_ && found != open_.end()) {
    open_.erase(open_.begin(), found);
    ready_.clear();
  }
  return release();
}

std::vector<RequestId> Coupling::overdue(double now_s, std::vector<RequestId>& released) {
  if (open_.empty() || now_s < heard_s_ + kPatience_s) return {};
  heard_s_ = now_s;
  const auto complete = std::find_if(open_.begin(), open_.end(), [](const Open& o) { return o.complete; });
  if (complete == open_.end()) return open();
  open_.erase(open_.begin(), complete);
  released = release();
  return {};
}

std::vector<RequestId> Coupling::open() const {
  std::vector<RequestId> out;
  for (const Open& o : open_)
    if (!o.complete) out.push_back(o.request);
  return out;
}

std::optional<RequestId> Coupling::take() {
  CHECK(!displaying_);
  if (ready_.empty()) return std::nullopt;
  const RequestId out = ready_.front();
  ready_.pop_front();
  displaying_ = true;
  return out;
}

bool StallWatch::waiting(double now_s, double begin_s, double last_sign_s, const CouplingState& coupling) {
  if (!since_s_) since_s_ = begin_s;
  if (!told_ && now_s - *since_s_ >= kLong_s) {
    told_ = true;
    news_ = fmt::format(
        "no view update for {:.1f} s ({}): the picture stays; requests are sent again every {:.0f} s, and {:.0f} s "
        "after the last sign of an answer frames are drawn from what is there",
        now_s - *since_s_, coupling_text(coupling), Coupling::kPatience_s, most_s_);
  }
  if (!draws_ && now_s - std::max(*since_s_, last_sign_s) >= most_s_) {
    draws_ = true;
    news_ = fmt::format("no view update for {:.1f} s: frames are drawn from what is there until one comes",
                        now_s - *since_s_);
  }
  return draws_;
}

void StallWatch::over(double now_s) {
  if (told_) news_ = fmt::format("the display goes on, after {:.1f} s without a view update", now_s - *since_s_);
  since_s_.reset();
  told_ = draws_ = false;
}

std::optional<std::string> StallWatch::take_news() { return std::exchange(news_, std::nullopt); }

}  // namespace telesplat::viewer
