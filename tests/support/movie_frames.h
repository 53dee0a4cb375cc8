// What a movie of a run must show, for end-to-end tests: the frames that were on screen, as the run's pictures have them.
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "common/image/file.h"
#include "tests/support/pipeline_run.h"
#include "tools/common/csv_table.h"

namespace telesplat::test {

/// What a movie of `fps` frames a second must show: the number of the displayed frame for each of its frames.
inline std::vector<uint64_t> on_screen(const std::string& run, double fps) {
  const auto table = tools::CsvTable::read(run + "/frames.csv", {});
  EXPECT_TRUE(table.ok()) << table.error().text;
  const auto t = table->numbers(*table->column("t_s")), took = table->numbers(*table->column("construction_ms")),
             number = table->numbers(*table->column("frame"));
  const auto shown_s = [&](size_t i) { return t[i] + took[i] / 1e3 - (t[0] + took[0] / 1e3); };
  std::vector<uint64_t> out;
  size_t i = 0;
  for (size_t k = 0; double(k) / fps <= shown_s(t.size() - 1); ++k) {
    while (i + 1 < t.size() && shown_s(i + 1) <= double(k) / fps) ++i;
    out.push_back(uint64_t(number[i]));
  }
  return out;
}

/// Makes a folder of pictures of the run, which recorded every frame, and compares each with the recorded one. Returns
/// how many were compared: the disk may not have kept up.
inline size_t expect_as_displayed(const PipelineRun& run, double fps) {
  const std::string folder = run.folder() / "frames";
  Program movie("telesplat", {"movie", run.out(), folder + "/", "--fps", fmt::format("{}", fps)},
                run.folder() / "movie");
  EXPECT_EQ(movie.wait(100), 0) << movie.err();
  const auto wanted = on_screen(run.out(), fps);
  size_t compared = 0;
  for (size_t k = 0; k < wanted.size(); ++k) {
    const std::string mine = fmt::format("{}/{:06}.png", folder, k);
    const std::string recorded = fmt::format("{}/images/frame-{:06}.png", run.out(), wanted[k]);
    EXPECT_TRUE(std::filesystem::exists(mine)) << mine;
    if (!std::filesystem::exists(recorded) || !std::filesystem::exists(mine)) continue;
    const auto a = image::read_view(mine), b = image::read_view(recorded);
    EXPECT_TRUE(a.ok() && b.ok());
    if (!a || !b) continue;
    EXPECT_EQ(a->width, b->width);
    EXPECT_TRUE(a->colour == b->colour) << "movie frame " << k << " is not displayed frame " << wanted[k];
    ++compared;
  }
  EXPECT_FALSE(std::filesystem::exists(fmt::format("{}/{:06}.png", folder, wanted.size()))) << "there is one too many";
  EXPECT_GT(compared, wanted.size() / 2);
  return compared;
}

}  // namespace telesplat::test
