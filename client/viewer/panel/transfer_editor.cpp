#include "client/viewer/panel/transfer_editor.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <utility>

namespace telesplat::viewer {

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

double TransferEditor::lo() const {
  return std::min(range_.lo, std::max(wanted_.points.front().value, range_.lo - (range_.hi - range_.lo)));
}
double TransferEditor::hi() const {
  const double width = std::max(range_.hi - range_.lo, 1e-9);
  return std::max(lo() + width, std::min(wanted_.points.back().value, range_.hi + width));
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
  const double least = index > 0 ? points[index - 1].value : lo();
  const double most = index + 1 < points.size() ? points[index + 1].value : hi();
  points[index].value = std::clamp(value, std::min(least, most), std::max(least, most));
  points[index].opacity = float(std::clamp(opacity, 0.0, 1.0));
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

bool TransferEditor::colour(double now_s, size_t index, float r, float g, float b) {
  if (index >= wanted_.points.size()) return false;
  volume::TransferFunction next = wanted_;
  Point& p = next.points[index];
  p.r = std::clamp(r, 0.0f, 1.0f), p.g = std::clamp(g, 0.0f, 1.0f), p.b = std::clamp(b, 0.0f, 1.0f);
  return change(now_s, std::move(next));
}

Status TransferEditor::save(const std::string& path, std::string_view name) const {
  std::ofstream out(path, std::ios::binary);
  out << volume::to_paraview_json(wanted_, name);
  out.close();
  return out ? ok_status() : Status(Error{path + ": the transfer function cannot be written there"});
}

}  // namespace telesplat::viewer
