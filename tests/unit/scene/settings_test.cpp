// The table of settings that may change while a session runs, and the page that lists them.
#include "common/scene/settings.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <set>

namespace telesplat::scene {
namespace {

TEST(Settings, HaveNamesOfTheirOwnAndAnOrderEach) {
  std::set<std::string_view> names;
  for (const Setting& s : settings()) {
    EXPECT_TRUE(names.insert(s.name).second) << s.name;
    EXPECT_EQ(find_setting(s.name), &s);
    EXPECT_FALSE(s.order.empty() || s.section.empty() || s.what.empty()) << s.name;
    EXPECT_FALSE(s.what.ends_with('.')) << s.name;
    ASSERT_NE(setting_of_order(s.order), nullptr);
    EXPECT_EQ(setting_of_order(s.order)->keeper, s.keeper) << s.order << ": one order has one keeper";
    EXPECT_NE(help_of_order(s.order).find(s.what), std::string::npos) << s.name;
  }
  EXPECT_EQ(find_setting("no such"), nullptr);
  EXPECT_EQ(setting_of_order("stop"), nullptr);
  EXPECT_EQ(help_of_order("clip"), find_setting("clip")->what);
  EXPECT_TRUE(help_of_order("colour").starts_with("array: "));
}

TEST(Settings, OfAllKindsOrOfSomeAreNamed) {
  EXPECT_EQ(text_of(Kinds::all()), "all");
  EXPECT_EQ(text_of({Kind::kMesh, Kind::kVolume}), "mesh, volume");
}

TEST(Settings, AreThePagesTable) {
  std::ifstream in(TELESPLAT_WINDOW_PAGE);
  const std::string page{std::istreambuf_iterator<char>(in), {}};
  EXPECT_NE(page.find(settings_page()), std::string::npos)
      << "docs/window.md lacks the table that `telesplat ctl settings` prints:\n"
      << settings_page();
}

}  // namespace
}  // namespace telesplat::scene
