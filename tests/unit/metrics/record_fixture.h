// A record of a run in a folder of its own.
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>

#include "services/master/record/run_record.h"

namespace telesplat::metrics {

class Record : public ::testing::Test {
 protected:
  Record() {
    std::string pattern = (std::filesystem::temp_directory_path() / "telesplat-record-XXXXXX").string();
    folder = mkdtemp(pattern.data());
    record = std::move(RunRecord::open(folder + "/run")).value();
  }
  ~Record() override { std::filesystem::remove_all(folder); }
  std::string text(const std::string& name) const {
    std::ifstream in(folder + "/run/" + name);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  static wire::TileDone tile(uint64_t frame, uint64_t number, double begin_s) {
    wire::TileDone t;
    t.frame = {frame};
    t.tile = number;
    t.samples = 1000;
    t.kept = 100;
    t.bytes_sampled = 4000;
    t.bytes_sent = 500;
    t.moments.sample_begin_s = begin_s;
    t.moments.sample_end_s = begin_s + 0.010;
    t.moments.encode_end_s = begin_s + 0.012;
    t.moments.receive_s = begin_s + 0.013;
    t.moments.packed_s = begin_s + 0.018;
    return t;
  }

  std::string folder;
  std::unique_ptr<RunRecord> record;
  Process viewer{"viewer", "viewer-1", 5, {{"coupling", "async"}, {"width", "640"}}, {{"peak_rss_mb", 20}}};
};

}  // namespace telesplat::metrics
