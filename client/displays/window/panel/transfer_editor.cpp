#include "client/displays/window/panel/transfer_editor.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

#include "common/core/within.h"

namespace telesplat::viewer {
namespace {

bool has_width(const volume::ValueRange& range) { return range.hi / 2 - range.lo / 2 > 0; }
double room_around(double value) { return std::max(0.5, std::abs(value) / 1000); }

// Computes with halves: the difference of two finite numbers may be infinite.
double share_of(double value, double lo, double hi) {
  return within((value / 2 - lo / 2) / (hi / 2 - lo / 2), -1.0, 2.0);
}

}  // namespace

void TransferEditor::on_session(double now_s, const volume::Session& session,
                                const std::optional<volume::Histogram>& histogram) {
  told_ = session.transfer;
  range_ = session.range;
  histogram_ = histogram;
  if (told_ == wanted_) changed_s_ = -1e9;
  if (now_s - changed_s_ > kPatience_s) wanted_ = told_;
}

void TransferEditor::on_refusal() {
  wanted_ = told_;
  changed_s_ = -1e9;
}

// A range of one value gets some room around it.
double TransferEditor::lo() const { return has_width(range_) ? range_.lo : range_.lo - room_around(range_.lo); }
double TransferEditor::hi() const { return has_width(range_) ? range_.hi : range_.lo + room_around(range_.lo); }

double TransferEditor::share(double value) const { return share_of(value, lo(), hi()); }
double TransferEditor::value_at(double share) const { return std::lerp(lo(), hi(), share); }

// logarithmic: because backgrounds have thousands of times as many voxels as the rest.
std::vector<HistogramBar> bars_of(const volume::Histogram& histogram, double lo, double hi, bool logarithmic) {
  std::vector<HistogramBar> out;
  const auto& counts = histogram.counts;
  const auto height = [&](uint64_t n) { return logarithmic ? std::log1p(double(n)) : double(n); };
  const auto edge = [&](size_t i) {
    return share_of(std::lerp(histogram.lo, histogram.hi, double(i) / double(counts.size())), lo, hi);
  };
  double most = 0;
  for (size_t i = 0; i < counts.size(); ++i) {
    const HistogramBar bar{std::max(0.0, edge(i)), std::min(1.0, edge(i + 1)), height(counts[i])};
    if (bar.height <= 0 || bar.to <= bar.from) continue;
    most = std::max(most, bar.height);
    out.push_back(bar);
  }
  for (HistogramBar& bar : out) bar.height /= most;
  return out;
}

std::vector<HistogramBar> TransferEditor::bars(bool logarithmic) const {
  return histogram_ ? bars_of(*histogram_, lo(), hi(), logarithmic) : std::vector<HistogramBar>();
}

std::vector<TransferEditor::Spot> TransferEditor::curve() const {
  std::vector<Spot> out{{0, double(wanted_.at(lo()).opacity)}};
  for (const Point& p : wanted_.points)
    if (p.value > lo() && p.value < hi()) out.push_back({share(p.value), double(p.opacity)});
  out.push_back({1, double(wanted_.at(hi()).opacity)});
  return out;
}

bool TransferEditor::change(double now_s, volume::TransferFunction next) {
  if (next == wanted_ || !volume::validate(next)) return false;
  if (volume::to_text(next).size() > volume::kMaxTransferText) return false;
  wanted_ = std::move(next);
  changed_s_ = now_s;
  return true;
}

bool TransferEditor::move(double now_s, size_t index, double value, double opacity) {
  if (index >= wanted_.points.size() || !std::isfinite(value) || !std::isfinite(opacity)) return false;
  volume::TransferFunction next = wanted_;
  auto& points = next.points;
  const double least = index > 0 ? points[index - 1].value : -volume::kMaxTransferValue;
  const double most = index + 1 < points.size() ? points[index + 1].value : volume::kMaxTransferValue;
  points[index].value = within(value, least, most);
  points[index].opacity = float(within(opacity, 0.0, 1.0));
  return change(now_s, std::move(next));
}

bool TransferEditor::add(double now_s, double value) {
  if (!std::isfinite(value) || wanted_.points.size() >= volume::kMaxTransferPoints) return false;
  volume::TransferFunction next = wanted_;
  Point point = next.at(value);
  point.value = value;
  const auto after = std::upper_bound(next.points.begin(), next.points.end(), value,
                                      [](double v, const Point& p) { return v < p.value; });
  next.points.insert(after, point);
  return change(now_s, std::move(next));
}

bool TransferEditor::remove(double now_s, size_t index) {
  if (index >= wanted_.points.size() || wanted_.points.size() <= 2) return false;
  volume::TransferFunction next = wanted_;
  next.points.erase(next.points.begin() + std::ptrdiff_t(index));
  return change(now_s, std::move(next));
}

bool TransferEditor::set_window(double now_s, double window, double level) {
  if (!std::isfinite(window) || !std::isfinite(level) || window < 0) return false;
  constexpr double kMost = volume::kMaxTransferValue;
  const double from = within(level - window / 2, -kMost, kMost), to = within(level + window / 2, -kMost, kMost);
  const double first = wanted_.points.front().value, width = this->window();
  volume::TransferFunction next = wanted_;
  double least = from;
  for (size_t i = 0; i < next.points.size(); ++i) {
    double& value = next.points[i].value;
    const double share =
        width > 0 ? (value - first) / width : double(i) / double(std::max<size_t>(1, next.points.size() - 1));
    value = least = within(std::lerp(from, to, share), least, to);
  }
  return change(now_s, std::move(next));
}

bool TransferEditor::colour(double now_s, size_t index, float r, float g, float b) {
  if (index >= wanted_.points.size()) return false;
  volume::TransferFunction next = wanted_;
  Point& p = next.points[index];
  p.r = within(r, 0.0f, 1.0f), p.g = within(g, 0.0f, 1.0f), p.b = within(b, 0.0f, 1.0f);
  return change(now_s, std::move(next));
}

Status TransferEditor::save(const std::string& path, std::string_view name) const {
  std::ofstream out(path, std::ios::binary);
  out << volume::to_paraview_json(wanted_, name);
  out.close();
  return out ? ok_status() : Status(Error{path + ": the transfer function cannot be written there"});
}

}  // namespace telesplat::viewer
