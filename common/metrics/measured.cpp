#include "common/metrics/measured.h"

#include <fmt/format.h>

#include <algorithm>

namespace telesplat::metrics {
namespace {
constexpr size_t kMaxValues = 50'000'000;
}

std::vector<double> Rows::column(const std::string& name) const {
  std::vector<double> out;
  const auto c = std::find(columns.begin(), columns.end(), name);
  if (c == columns.end()) return out;
  for (size_t i = size_t(c - columns.begin()); i < values.size(); i += columns.size()) out.push_back(values[i]);
  return out;
}

Rows* Measured::table(const std::string& name) {
  if (name == "frames") return &frames;
  if (name == "updates") return &updates;
  if (name == "stages") return &stages;
  return nullptr;
}

Status Measured::add(const std::string& viewer, const wire::MetricRows& more) {
  Rows& rows = *table(more.table);
  const size_t width = more.columns.size();
  if (width == 0 || more.values.size() % width)
    return Error{
        fmt::format("table {}: {} values do not fill rows of {} columns", more.table, more.values.size(), width)};
  if (!rows.columns.empty() && rows.columns != more.columns)
    return Error{fmt::format("table {}: columns differ from those of its first rows", more.table)};
  if (rows.values.size() + more.values.size() > kMaxValues)
    return Error{fmt::format("table {}: more than {} values", more.table, kMaxValues)};
  rows.columns = more.columns;
  rows.values.insert(rows.values.end(), more.values.begin(), more.values.end());
  const auto known = std::find(viewers.begin(), viewers.end(), viewer);
  rows.viewers.insert(rows.viewers.end(), more.values.size() / width, uint32_t(known - viewers.begin()));
  if (known == viewers.end()) viewers.push_back(viewer);
  return ok_status();
}

}  // namespace telesplat::metrics
