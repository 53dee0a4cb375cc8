// Undo of the camera, of the look, and of the panel's orders to the session.
#include <gtest/gtest.h>

#include "client/displays/window/input/interaction.h"
#include "client/displays/window/panel/order_undo.h"
#include "common/core/within.h"
#include "common/scene/clip_order.h"
#include "common/scene/colouring.h"

namespace telesplat::viewer {
namespace {

using geometry::Pose;

TEST(UndoStack, TakesBackAndDoesAgainInOrder) {
  UndoStack stack;
  int value = 0;
  const auto change = [&](double now_s, int to, const char* subject = "") {
    stack.did(now_s, {"value", [&value, before = value] { value = before; }, [&value, to] { value = to; }, subject});
    value = to;
  };
  EXPECT_EQ(stack.undo(), "there is nothing to undo");
  for (int i = 1; i <= 3; ++i) change(i, i);
  EXPECT_EQ(stack.undo(), "undone: value");
  EXPECT_EQ(value, 2);
  stack.undo();
  stack.undo();
  EXPECT_EQ(value, 0);
  EXPECT_FALSE(stack.can_undo());
  EXPECT_EQ(stack.redo(), "done again: value");
  EXPECT_EQ(value, 1);
  change(10, 7);  // the undone change is gone
  EXPECT_EQ(stack.redo(), "there is nothing to do again");
  stack.undo();
  EXPECT_EQ(value, 1);
  // Dragging a slider is one change; after a rest it is another one.
  for (int i = 0; i < 50; ++i) change(20 + 0.1 * i, 100 + i, "slider");
  change(40, 200, "slider");
  stack.undo();
  EXPECT_EQ(value, 149);
  stack.undo();
  EXPECT_EQ(value, 1);
  stack.redo();
  EXPECT_EQ(value, 149);
  for (size_t i = 0; i < 3 * UndoStack::kMost; ++i) change(100, int(i));
  size_t deeds = 0;
  for (; stack.can_undo(); ++deeds) stack.undo();
  EXPECT_EQ(deeds, UndoStack::kMost);
}

class UndoTest : public testing::Test {
 protected:
  void tap(Key key) { i_.key(key, true), i_.key(key, false); }
  Pose wait(double seconds = 3) {
    Pose p;
    for (int n = 0; n <= int(seconds * 60); ++n) p = i_.advance(now_s_ += 1.0 / 60, true);
    return p;
  }
  static void expect_near(const Pose& a, const Pose& b) {
    EXPECT_LT(glm::distance(a.position_room, b.position_room), 1e-4);
    EXPECT_GT(std::abs(glm::dot(a.orientation, b.orientation)), 1 - 1e-8);
  }
  double now_s_ = 100;
  Interaction i_{std::nullopt, Look{{splat::Kernel::kDisc, {true, true, true}}, true}};
};

TEST_F(UndoTest, JumpsOfTheCameraAreTakenBack) {
  i_.move(0.5, 0.5);
  i_.button(MouseButton::kLeft, true);
  i_.move(0.8, 0.6);
  i_.button(MouseButton::kLeft, false);
  const Pose mine = wait();
  const Pose kept = geometry::look_at({0.3, 0.2, 0.5}, {0.1, 0, 0});
  tap(Key::kR);
  const Pose home = wait();
  i_.go_to(kept);
  wait();
  i_.centre_on({0.1, 0.1, 0.1});
  const Pose centred = wait();
  i_.travel(geometry::look_at({2, 0, 0}, {0, 0, 0}), "view from +X");
  wait();
  i_.control('Z');
  expect_near(wait(), centred);
  i_.control('Z');
  expect_near(wait(), kept);
  i_.control('Z');
  expect_near(wait(), home);
  i_.control('Z');
  expect_near(wait(), mine);
  EXPECT_EQ(i_.take_notes().back(), "undone: first view");
  i_.control('Z', true);
  expect_near(wait(), home);
  i_.control('Y');
  expect_near(wait(), kept);
  EXPECT_EQ(i_.take_notes().back(), "done again: view");
}

TEST_F(UndoTest, AJumpOutOfFlightIsTakenBackToWhereItWasFlown) {
  tap(Key::kF);
  i_.key(Key::kW, true);
  wait(0.5);
  i_.key(Key::kW, false);
  const Pose flown = wait();
  tap(Key::kR);
  wait();
  i_.control('Z');
  expect_near(wait(), flown);
  EXPECT_FALSE(i_.wants_pointer());
}

TEST_F(UndoTest, LooksAreTakenBack) {
  wait(0.1);
  tap(Key::k1);
  tap(Key::k8);
  Look look = i_.look();
  look.background = 0xffffff;  // another person's order, which this person cannot undo
  i_.set_look(look);
  i_.control('Z');
  EXPECT_TRUE(i_.look().lit);
  EXPECT_EQ(i_.look().render.kernel, splat::Kernel::kSquare);
  i_.control('Z');
  EXPECT_EQ(i_.look().render.kernel, splat::Kernel::kDisc);
  for (int n = 0; n < 3; ++n) i_.control('Y');
  EXPECT_EQ(i_.look().render.kernel, splat::Kernel::kSquare);
  EXPECT_FALSE(i_.look().lit);
  EXPECT_EQ(i_.look().background, 0xffffffu);
}

// ---- orders ----

std::shared_ptr<wire::Welcome> session() {
  auto out = std::make_shared<wire::Welcome>();
  out->facts["transfer"] = "0:#000000:0,255:#ffffff:0.5";
  out->parameters = {{"volume.step", 3}, {"c.y", -0.25}};
  return out;
}

OrderAnswer obeyed(const Order& order) { return {order, true, "epoch 2"}; }

TEST(OrderUndo, TheSameOrderWithWhatTheSessionHad) {
  OrderUndo undo;
  const Order tf{"tf", {{"transfer", "skin"}}, "transfer"}, set{"set", {{"c.y", "0.5"}}, "c.y"},
      clip{"clip", {{"clip", "plane x>=50%"}}, ""}, colour{"colour", {{"array", "t"}}, ""},
      coupling{"coupling", {{"coupling", "sync"}}, ""};
  EXPECT_EQ(undo.back_of(tf), std::nullopt) << "no session is known";
  const auto told = session();
  undo.on_session(told);
  EXPECT_EQ(undo.back_of(tf), (Order{"tf", {{"transfer", "0:#000000:0,255:#ffffff:0.5"}}, "transfer"}));
  EXPECT_EQ(undo.back_of(set), (Order{"set", {{"c.y", "-0.25"}}, "c.y"}));
  EXPECT_EQ(undo.back_of(clip), (Order{"clip", {{"clip", "off"}}, ""}));
  EXPECT_EQ(undo.back_of(colour), (Order{"colour", {{"array", "none"}}, ""}));
  EXPECT_EQ(undo.back_of(coupling), std::nullopt) << "it does not change the picture";
  told->facts[scene::kClipOrderFact] = "plane y<=3";
  scene::Colouring colouring;
  colouring.array = "wind.x", colouring.lo = -5, colouring.hi = 7.25;
  colouring.map = *colour::find_colour_map(colour::colour_map_names().front());
  told->facts[scene::kColouringFact] = scene::to_text(colouring);
  EXPECT_EQ(undo.back_of(clip)->arguments.at("clip"), "plane y<=3");
  const Order back = *undo.back_of(colour);
  const auto by = scene::parse_colour_by(back.arguments.at("array"));
  ASSERT_TRUE(by);
  EXPECT_EQ(by->array, "wind.x");
  EXPECT_EQ(by->lo, -5);
  EXPECT_EQ(by->hi, 7.25);
  EXPECT_TRUE(colour::from_text(back.arguments.at("map")));
}

TEST(OrderUndo, WhatWasRefusedOrUndoesIsNoDeed) {
  OrderUndo undo;
  const auto told = session();
  undo.on_session(told);
  const Order skin{"tf", {{"transfer", "skin"}}, "transfer"}, bone{"tf", {{"transfer", "bone"}}, "transfer"};
  undo.given(skin);
  EXPECT_EQ(undo.answered({skin, false, "no such preset"}), std::nullopt);
  undo.given(skin, true);
  EXPECT_EQ(undo.answered(obeyed(skin)), std::nullopt);
  // The second of two orders that wait replaces the first, which never gets an answer.
  undo.given(skin);
  told->facts["transfer"] = "1:#000000:0,2:#ffffff:1";
  undo.given(bone);
  EXPECT_EQ(undo.answered(obeyed(bone))->arguments.at("transfer"), "0:#000000:0,255:#ffffff:0.5");
  EXPECT_EQ(undo.answered(obeyed(bone)), std::nullopt) << "once";
}

TEST(Within, KeepsToBoundsThatCross) {
  EXPECT_EQ(within(5, 0, 3), 3);
  EXPECT_EQ(within(5, 3, 0), 3);
  EXPECT_EQ(within(-5, 3, 0), 0);
  EXPECT_EQ(within(1.5f, 2.0f, 1.0f), 1.5f);
  EXPECT_EQ(within(7, 2, 2), 2);
  EXPECT_TRUE(std::isnan(within(std::nan(""), 1.0, 0.0)));
}

}  // namespace
}  // namespace telesplat::viewer
