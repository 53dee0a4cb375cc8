// The stages of a view update.
#include "common/metrics/stages.h"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <string>

namespace telesplat::metrics {
namespace {

constexpr UpdateMoments kUpdate{
    .requested_s = 100, .arrived_s = 100.130, .decode_begin_s = 100.132, .decoded_s = 100.137, .complete_s = 100.140};

std::map<std::string, double> named(const StagesMs& ms) {
  std::map<std::string, double> out;
  for (const auto& column : kStageColumns) out[column.name] = column.get(ms);
  return out;
}
double sum(const StagesMs& ms) { return std::accumulate(ms.begin(), ms.end(), 0.0); }

TEST(Stages, EachEndsWhereTheNextBegins) {
  const wire::Moments part{.requested_s = 100,
                           .received_s = 100.001,
                           .begun_s = 100.003,
                           .planned_s = 100.013,
                           .leased_s = 100.014,
                           .lease_arrived_s = 100.016,
                           .fetch_s = 0.020,
                           .sample_begin_s = 100.046,
                           .sample_end_s = 100.086,
                           .encode_end_s = 100.089,
                           .arrived_s = 100.099,
                           .receive_s = 100.100,
                           .packed_s = 100.110,
                           .published_s = 100.111};
  const auto ms = stages_ms(part, kUpdate);
  const auto by = named(ms);
  const std::map<std::string, double> expected{
      {"request_network_ms", 1}, {"view_queue_ms", 2},     {"plan_ms", 10},        {"lease_queue_ms", 1},
      {"lease_network_ms", 2},   {"sampler_queue_ms", 10}, {"fetch_ms", 20},       {"sampling_ms", 40},
      {"encoding_ms", 3},        {"tile_network_ms", 10},  {"packer_queue_ms", 1}, {"packing_ms", 10},
      {"publishing_ms", 1},      {"patch_network_ms", 19}, {"viewer_queue_ms", 2}, {"decoding_ms", 5},
      {"insertion_ms", 3}};
  for (const auto& [name, value] : expected) EXPECT_NEAR(by.at(name), value, 1e-6) << name;
  EXPECT_NEAR(sum(ms), 140, 1e-6);
  EXPECT_NEAR(sum_ms(ms, "queue_ms"), 16, 1e-6);
  EXPECT_NEAR(sum_ms(ms, "network_ms"), 32, 1e-6);
  EXPECT_NEAR(sum_ms(ms, ""), 140, 1e-6);
}

// A plan that needs no ray: no lease, no sampling.
TEST(Stages, WhatIsNotOnTheWayTakesNoTime) {
  const wire::Moments part{
      .requested_s = 100, .received_s = 100.001, .begun_s = 100.001, .planned_s = 100.020, .published_s = 100.021};
  const auto ms = stages_ms(part, kUpdate);
  const auto by = named(ms);
  EXPECT_NEAR(by.at("plan_ms"), 19, 1e-6);
  EXPECT_EQ(by.at("lease_queue_ms"), 0);
  EXPECT_EQ(by.at("sampling_ms"), 0);
  EXPECT_NEAR(by.at("publishing_ms"), 1, 1e-6);
  EXPECT_NEAR(by.at("patch_network_ms"), 109, 1e-6);
  EXPECT_NEAR(sum(ms), 140, 1e-6);
}

TEST(Stages, FetchingIsNoLongerThanTheSamplerHadTheLease) {
  wire::Moments part{.received_s = 100.001, .leased_s = 100.002, .lease_arrived_s = 100.010, .fetch_s = 5};
  part.sample_begin_s = part.sample_end_s = part.encode_end_s = 100.030;
  const auto by = named(stages_ms(part, kUpdate));
  EXPECT_NEAR(by.at("fetch_ms"), 20, 1e-6);
  EXPECT_NEAR(by.at("sampler_queue_ms"), 0, 1e-6);
}

// A peer's moments may be nonsense; the sum still is that of the viewer's own moments.
TEST(Stages, AddUpWhateverPeersSay) {
  wire::Moments part;
  double v = 1e6;
  for (double wire::Moments::*m : wire::kMoments) part.*m = v = -v * 0.7;
  EXPECT_NEAR(sum(stages_ms(part, kUpdate)), 140, 1e-3);
  EXPECT_NEAR(sum(stages_ms({}, kUpdate)), 140, 1e-6);
}

}  // namespace
}  // namespace telesplat::metrics
