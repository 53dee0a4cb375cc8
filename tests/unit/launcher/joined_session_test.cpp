// Messages for a person who joins a session.
#include "tools/telesplat/run/joined/joined_session.h"

#include <gtest/gtest.h>

namespace telesplat::launcher {
namespace {

using Lines = std::vector<std::string>;

constexpr const char* kMaster = "tcp://127.0.0.1:9";

nlohmann::json status(const std::string& scene, const std::string& lacks) {
  return {{"session", {{"scene", scene}}}, {"lacks", lacks}};
}

TEST(JoinedSession, SaysOnceThatItShowsSomethingElse) {
  JoinedSession session(kMaster, "data/plate.vtp");
  const auto empty = status("", ""), lucy = status("lucy", "");
  EXPECT_EQ(session.look(&empty, false, "", 0), Lines());
  EXPECT_EQ(session.look(&lucy, false, "", 1), Lines{"data/plate.vtp is not opened: the session shows lucy"});
  EXPECT_EQ(session.look(&lucy, false, "", 2), Lines());
}

TEST(JoinedSession, IsSilentWhereItShowsWhatWasNamed) {
  for (const char* shown : {"plate", "plate.vtp", "data/plate.vtp"}) {
    JoinedSession session(kMaster, "data/plate.vtp");
    const auto is = status(shown, "");
    EXPECT_EQ(session.look(&is, false, "", 0), Lines()) << shown;
  }
  JoinedSession session(kMaster, "plate2.vtp");
  const auto is = status("plate", "");
  EXPECT_EQ(session.look(&is, false, "", 0).size(), 1u) << "the beginning alone is not its name";
}

TEST(JoinedSession, SaysWhatTheSessionLacks) {
  JoinedSession session(kMaster, "");
  const auto is = status("lucy", "packer,sampler");
  Lines lines;
  for (int s = 0; s < 10; ++s)
    for (const auto& line : session.look(&is, false, "", s)) lines.push_back(line);
  EXPECT_EQ(lines, Lines{"the session has no packer and no sampler; waiting (3 s so far)"});
}

TEST(JoinedSession, SaysThatNoMasterIsThereOrThatItIsGone) {
  JoinedSession session(kMaster, "");
  EXPECT_EQ(session.look(nullptr, true, "", 0), Lines());
  EXPECT_EQ(session.look(nullptr, true, "", 3), Lines{"no master is at tcp://127.0.0.1:9; waiting (3 s so far)"});
  const auto is = status("lucy", "");
  EXPECT_EQ(session.look(&is, false, "", 4), Lines());
  for (int s = 5; s < 10; ++s) session.look(nullptr, false, "", s);
  EXPECT_EQ(session.look(nullptr, false, "", 11),
            Lines{"no master answers at tcp://127.0.0.1:9; waiting (4 s so far)"});
}

TEST(JoinedSession, SaysThatTheMasterRefuses) {
  JoinedSession session(kMaster, "");
  const std::string refusal = "the master at tcp://127.0.0.1:9 refuses: it wants a key (--keys DIR)";
  EXPECT_EQ(session.look(nullptr, true, refusal, 0), Lines());
  EXPECT_EQ(session.look(nullptr, true, refusal, 3), Lines{refusal + "; waiting (3 s so far)"});
}

}  // namespace
}  // namespace telesplat::launcher
