// Valid messages from any peer in any order: no process fails, and honest peers are served. Fuzz targets
// (tests/fuzz/play) do the same with bytes that the fuzzer finds.
#include "tests/support/play/play.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <string>
#include <vector>

#include "tests/support/play/dice.h"

namespace telesplat::test {
namespace {

constexpr size_t kBytes = 3000;

// reaches: states that some of the plays must reach.
void expect_no_complaint(Play play, uint64_t seeds, const std::vector<std::string>& reaches) {
  // People who look for mistakes may ask for more seeds.
  if (const char* more = std::getenv("TELESPLAT_PLAYS")) seeds = std::strtoull(more, nullptr, 10);
  Reached reached;
  for (uint64_t seed = 1; seed <= seeds; ++seed) {
    const Complaint complaint = play(bytes_of_seed(seed, kBytes), &reached);
    ASSERT_FALSE(complaint) << "seed " << seed << ": " << *complaint;
  }
  for (const auto& what : reaches) EXPECT_GT(reached[what], 0u) << what;
  for (const auto& [what, times] : reached) testing::Test::RecordProperty(what, std::to_string(times));
}

TEST(Play, TheMasterServesTheHonestWhateverOthersSay) {
  expect_no_complaint(
      play_master, 100,
      {"welcome", "lease", "plan_request", "control_reply", "order", "swap", "slab_assignment", "frames completed"});
}
TEST(Play, AViewerFollowsAnHonestPackerWhateverCameBefore) {
  expect_no_complaint(play_receiver, 100, {"points", "gaps", "epochs shown", "decode errors", "patches refined"});
}

}  // namespace
}  // namespace telesplat::test
