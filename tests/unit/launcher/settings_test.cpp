// `telesplat ctl` has every setting, and the launcher reads its orders from a status.
#include "common/scene/settings.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tools/telesplat/command.h"
#include "tools/telesplat/control/client.h"
#include "tools/telesplat/run/run_options.h"

namespace telesplat::launcher {
namespace {

TEST(Settings, EachIsAnOrderOfCtlWithItsHelp) {
  const Command ctl = control_command();
  for (const auto& setting : scene::settings()) {
    const auto order = std::find_if(ctl.commands.begin(), ctl.commands.end(),
                                    [&](const Command& c) { return c.name == setting.order; });
    ASSERT_NE(order, ctl.commands.end()) << setting.name << ": there is no telesplat ctl " << setting.order;
    EXPECT_EQ(order->help, scene::help_of_order(setting.order));
  }
}

TEST(Settings, TheirFlagsAreThoseOfViewAndRun) {
  RunOptions view = view_defaults(), run;
  const options::Table of_view = table(view), of_run = table(run);
  for (const auto& setting : scene::settings()) {
    if (setting.flag.empty()) continue;
    const std::string flag(setting.flag);
    EXPECT_TRUE(options::find(of_view, flag) || options::find(of_run, flag)) << setting.name << ": " << flag;
  }
}

TEST(Settings, WishesAreReadFromAStatusWithoutFear) {
  const auto status = nlohmann::json::parse(
      R"({"session": {"pid": 12}, "wishes": [{"number": 3, "command": "samplers", "arguments": {"value": "2"}},
          {"number": 0, "command": "up"}, 7, {"command": "iso"}, {"number": 4, "command": 5}]})");
  const auto wishes = wishes_of(status);
  ASSERT_EQ(wishes.size(), 1u);
  EXPECT_EQ(wishes[0].number, 3u);
  EXPECT_EQ(wishes[0].master, 12u);
  EXPECT_EQ(wishes[0].order, "samplers");
  EXPECT_EQ(wishes[0].value, "2");
  EXPECT_TRUE(wishes_of(nlohmann::json::object()).empty());
}

}  // namespace
}  // namespace telesplat::launcher
