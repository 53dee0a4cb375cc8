#include "tools/telesplat/record/skip.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/master/record/lives.h"
#include "common/metrics/statistics.h"
#include "services/master/record/summary.h"
#include "tools/common/csv_table.h"
#include "tools/common/json_file.h"

namespace telesplat::launcher {
namespace {

// Computes quality_json() of the frames in quality.csv that were displayed after skip_s.
Status verify_again(const std::string& directory, double skip_s, nlohmann::ordered_json& quality) {
  const auto table = tools::CsvTable::read(directory + "/quality.csv", {});
  if (!table) return table.error();
  const auto at = table->column("t_s"), object = table->column("object_pixels");
  if (!at || !object) return at ? object.error() : at.error();
  const auto t_s = table->numbers(*at), object_pixels = table->numbers(*object);
  for (const char* name : {"psnr_db", "ssim", "flip", "hole_fraction", "flicker", "popping"}) {
    const auto column = table->column(name);
    if (!column) return column.error();
    const auto all = table->numbers(*column);
    std::vector<double> values;
    for (size_t row = 0; row < t_s.size(); ++row)
      if (t_s[row] >= skip_s && object_pixels[row] > 0 && !table->text(row, *column).empty())
        values.push_back(all[row]);
    quality[name] = metrics::distribution_json(values, 9);
    if (name == std::string_view("psnr_db")) quality["views"] = values.size();
  }
  return ok_status();
}

}  // namespace

Result<nlohmann::ordered_json> summary_without_beginning(const std::string& directory, double skip_s) {
  auto read = tools::read_json_object(directory + "/summary.json");
  if (!read) return read.error();
  nlohmann::ordered_json out = *std::move(read);
  if (skip_s <= 0) return out;
  const auto frames = tools::CsvTable::read(directory + "/frames.csv", {});
  if (!frames) return frames.error();
  const auto column = frames->column("begin_s");
  if (!column) return column.error();
  const auto begin_s = frames->numbers(*column);
  if (begin_s.empty()) return Error{frames->path() + ": holds no frame"};
  const auto [first, last] = std::minmax_element(begin_s.begin(), begin_s.end());
  if (*first + skip_s > *last)
    return Error{fmt::format("--skip {}: {} lasts {:.1f} s", skip_s, directory, *last - *first)};
  const auto lives = metrics::read_lives(directory);
  if (!lives) return lives.error();
  metrics::measure_again(metrics::read_back(directory, *lives, *first + skip_s), out);
  if (out.contains("quality") && out["quality"].is_object())
    if (const Status s = verify_again(directory, skip_s, out["quality"]); !s) return s.error();
  out["skipped_s"] = skip_s;
  return out;
}

}  // namespace telesplat::launcher
