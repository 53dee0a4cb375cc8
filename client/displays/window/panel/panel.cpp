#include "client/displays/window/panel/panel.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/core/within.h"
#include "common/wire/limits.h"

namespace telesplat::viewer {
namespace {

constexpr double kRatePeriod_s = 0.5;
enum PlotIndex { kInterFrame, kLatency, kPoints, kBytes };

std::vector<FigurePlots::Plot> make_plots() {
  const auto plot = [](const char* name, const char* unit, uint32_t colour, int digits, double floor) {
    return FigurePlots::Plot{name, unit, History(FigurePlots::kSpan_s), colour, digits, floor};
  };
  return {plot("inter-frame delay", "ms", 0x56b4e9, 1, 20), plot("update latency", "ms", 0xe69f00, 0, 100),
          plot("points drawn", "M", 0x009e73, 2, 0.1), plot("received", "MB/s", 0xcc79a7, 2, 0.1)};
}

}  // namespace

constexpr double kMostValue = 1e30;  // plots are drawn with float coordinates

void History::add(double t_s, double value) {
  if (!std::isfinite(t_s) || !(std::abs(value) < kMostValue)) return;
  if (!samples_.empty() && t_s < samples_.back().t_s) samples_.clear();
  samples_.push_back({t_s, value});
  // One older sample stays: the plot's left edge goes on from it.
  while (samples_.size() > 2 && (samples_[1].t_s < t_s - span_s_ || samples_.size() > kMost)) samples_.pop_front();
}

std::vector<float> History::columns(double now_s, size_t count) const {
  constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
  std::vector<float> out(count, kNone);
  const double from_s = now_s - span_s_;
  float before = kNone;  // value with which the first column begins
  for (const auto& s : samples_) {
    if (s.t_s < from_s) {
      before = float(s.value);
      continue;
    }
    if (s.t_s > now_s) break;
    const auto column = std::min(count - 1, size_t((s.t_s - from_s) / span_s_ * double(count)));
    out[column] = std::isnan(out[column]) ? float(s.value) : std::max(out[column], float(s.value));
  }
  for (float& value : out) before = value = std::isnan(value) ? before : value;
  return out;
}

Panel::Panel(Setup setup) : setup_(std::move(setup)), shown_(setup_.shown) {}

FigurePlots::FigurePlots() : plots_(make_plots()) {}

// Rates are means over half a second: single frames vary too much.
void FigurePlots::count_rates(const FrameFigures& f) {
  const double dt_s = f.now_s - rated_.now_s;
  if (dt_s >= 0 && dt_s < kRatePeriod_s) return;
  const bool counts = rated_.now_s > 0 && dt_s > 0 && f.frames >= rated_.frames;
  if (counts) {
    frames_a_second_ = double(f.frames - rated_.frames) / dt_s;
    plots_[kBytes].history.add(f.now_s, double(f.session.bytes_received - rated_.session.bytes_received) / 1e6 / dt_s);
  }
  rated_ = f;
}

void FigurePlots::add(const FrameFigures& f) {
  if (const double ms = f.frame.inter_frame_ms(); ms > 0) plots_[kInterFrame].history.add(f.now_s, ms);
  if (f.session.updates != newest_.session.updates) plots_[kLatency].history.add(f.now_s, f.session.latency_ms);
  plots_[kPoints].name = std::string(f.units.drawn) + " drawn";
  plots_[kPoints].history.add(f.now_s, double(f.frame.drawn.drawn) / 1e6);
  count_rates(f);
  newest_ = f;
}

void Panel::on_figures(const FrameFigures& f) {
  plots_.add(f);
  if (wished_coupling_ == f.frame.coupling) wished_coupling_.reset();
}

void Panel::on_answer(double now_s, const OrderAnswer& answer) {
  if (!answer.obeyed && answer.order.command == "coupling") wished_coupling_.reset();
  // Results of sliders are seen in the picture; refusals are always reported.
  if (!answer.obeyed)
    tell(now_s, answer.order.command + ": " + answer.text, true);
  else if (answer.order.subject.empty())
    tell(now_s, answer.order.command + ": " + answer.text);
}

void Panel::on_status(double now_s, const std::optional<SessionStatus>& status, const std::string& problem) {
  status_ = status;
  std::vector<std::string> missing = status ? missing_services(*status) : std::vector{problem};
  if (!status || missing.empty()) missing_since_s_ = 0;
  // Processes that start say hello one after the other.
  if (status && !missing.empty()) {
    if (missing_since_s_ == 0) missing_since_s_ = now_s;
    if (now_s - missing_since_s_ < kGrace_s) missing.clear();
  }
  if (missing == missing_) return;
  for (const auto& line : missing)
    if (std::find(missing_.begin(), missing_.end(), line) == missing_.end()) tell(now_s, line, true);
  missing_ = std::move(missing);
}

void Panel::tell(double now_s, std::string text, bool problem) {
  messages_.push_back({now_s, std::move(text), problem});
  if (messages_.size() > kMostMessages) messages_.pop_front();
}

std::vector<std::string> Panel::news(double now_s) const {
  if (!progress_.empty()) return {progress_};
  if (!missing_.empty()) return missing_;
  if (messages_.empty() || now_s - messages_.back().t_s > kTold_s) return {};
  return {messages_.back().text};
}

std::string Panel::value(const std::string& order) const {
  const auto found = values_.find(order);
  return found == values_.end() ? std::string() : found->second;
}

void Panel::choose(const std::string& order, const std::string& value) {
  values_[order] = value;
  chosen_.emplace_back(order, value);
}

void Panel::choose_coupling(const CouplingState& wish) {
  CouplingState coupling = coupling_state(wish.mode, within(wish.buffers, 1, int(wire::kMaxBuffers)));
  if (coupling == this->coupling()) return;
  std::map<std::string, std::string> arguments{{"coupling", coupling_name(coupling.mode)}, {"viewer", setup_.viewer}};
  if (coupling.mode == CouplingMode::kLoose) arguments["buffers"] = std::to_string(coupling.buffers);
  wished_coupling_ = coupling;
  order({"coupling", std::move(arguments), "coupling"});
}

}  // namespace telesplat::viewer
