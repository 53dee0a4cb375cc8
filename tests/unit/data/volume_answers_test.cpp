// A volume's data server between its sockets: epochs, weights, requests in order of rounds, answers in pieces.
#include "services/data/volume/answers.h"

#include <gtest/gtest.h>

#include "common/wire/serial.h"
#include "tests/support/volume/samples.h"

namespace telesplat::data {
namespace {

constexpr InstanceId kSelf{7}, kMaster{3};

wire::Welcome welcome_of(const VolumeStore& store, uint64_t epoch, const std::string& transfer = {}, int step = 0) {
  volume::Session session = store.session();
  session.step = step;
  if (!transfer.empty()) session.transfer = *volume::parse_transfer(transfer, session.range);
  wire::Welcome w;
  w.master = kMaster, w.epoch = EpochId{epoch};
  w.facts = volume::to_facts(session);
  w.facts["kind"] = "volume";
  w.parameters = volume::to_parameters(session);
  return w;
}

class Answers : public testing::Test {
 protected:
  // A column of 200 slices, too many for a single answer.
  std::unique_ptr<VolumeStore> store = open_or_fail(noise(3, {9, 7, 200}));
  VolumeAnswers answers{*store};

  void follow(uint64_t epoch, const std::string& transfer = {}) {
    const Status s = answers.follow(welcome_of(*store, epoch, transfer));
    ASSERT_TRUE(s) << s.error().text;
  }
  std::optional<wire::SliceWeights> weights() {
    const auto reply = answers.work(kSelf);
    if (!reply || reply->type != wire::SliceWeights::kName) return std::nullopt;
    EXPECT_TRUE(reply->peer.empty());
    return *wire::decode<wire::SliceWeights>(std::as_bytes(std::span(reply->body)));
  }
  // Returns its answer; bodies live as long as the fixture.
  std::optional<wire::VoxelData> data(std::string* peer = nullptr) {
    auto reply = answers.work(kSelf);
    if (!reply || reply->type != wire::VoxelData::kName) return std::nullopt;
    if (peer) *peer = reply->peer;
    bodies.push_back(std::move(reply->body));
    return *wire::decode<wire::VoxelData>(std::as_bytes(std::span(bodies.back())));
  }
  // True: queued. False: answered at once with an empty answer.
  bool ask(const wire::VoxelRequest& request, const std::string& peer = "a") {
    const auto reply = answers.ask(peer, request);
    EXPECT_TRUE(reply) << reply.error().text;
    if (!reply || !*reply) return bool(reply);
    const auto at_once = *wire::decode<wire::VoxelData>(std::as_bytes(std::span((*reply)->body)));
    EXPECT_FALSE(at_once.known);
    EXPECT_EQ(at_once.begin, request.begin);
    EXPECT_EQ((*reply)->peer, peer);
    return false;
  }
  volume::Voxels decoded(const wire::VoxelData& d) {
    const auto& size = store->session().grid.size;
    const std::span bytes(reinterpret_cast<const uint8_t*>(d.data.data()), d.data.size());
    auto v = volume::decode_voxels(bytes, size[0], size[1], int(d.begin), int(d.end), store->session().levels.count);
    EXPECT_TRUE(v) << v.error().text;
    return v ? *v : volume::Voxels{};
  }
  static wire::VoxelRequest request(uint64_t epoch, uint64_t begin, uint64_t end, uint64_t round = 0) {
    wire::VoxelRequest r;
    r.epoch = EpochId{epoch}, r.begin = begin, r.end = end, r.round = round;
    return r;
  }
  std::deque<std::string> bodies;
};

TEST_F(Answers, WeightsOfEveryEpochGoToTheMaster) {
  EXPECT_FALSE(answers.has_work());
  follow(1);
  ASSERT_TRUE(answers.has_work());
  const auto first = weights();
  ASSERT_TRUE(first);
  EXPECT_EQ(first->data, kSelf);
  EXPECT_EQ(first->epoch, EpochId{1});
  EXPECT_EQ(first->begin, 0u);
  EXPECT_EQ(first->voxels, *store->slice_weights(0, shown_levels(store->session().transfer, store->session().levels)));
  EXPECT_GT(first->bytes_per_voxel, 0.5);
  EXPECT_LT(first->bytes_per_voxel, 8);
  follow(1);
  EXPECT_FALSE(answers.has_work()) << "nothing new";
  follow(2, "0:#ffffff:0, 128:#ffffff:0, 255:#ffffff:1");
  const auto second = weights();
  ASSERT_TRUE(second);
  EXPECT_LT(second->voxels[0], first->voxels[0]);
  // Several epochs came without a request: only the newest one's weights are sent.
  follow(3);
  follow(4);
  EXPECT_EQ(weights()->epoch, EpochId{4});
  EXPECT_FALSE(answers.has_work());
}

TEST_F(Answers, ComeInPiecesThatMakeTheSlab) {
  follow(1);
  weights();
  const auto whole = *store->voxels(0, 20, 190, shown_levels(store->session().transfer, store->session().levels), {});
  size_t voxels = 0;
  int pieces = 0;
  for (uint64_t begin = 20; begin < 190; ++pieces) {
    ASSERT_TRUE(ask(request(1, begin, 190)));
    const auto d = data();
    ASSERT_TRUE(d && d->known);
    ASSERT_EQ(d->begin, begin);
    ASSERT_LE(d->end - d->begin, uint64_t(kSlicesAnAnswer));
    const auto v = decoded(*d);
    EXPECT_EQ(v.size(), d->voxels);
    EXPECT_TRUE(std::equal(v.level.begin(), v.level.end(), whole.level.begin() + ptrdiff_t(voxels)));
    EXPECT_TRUE(std::equal(v.normal.begin(), v.normal.end(), whole.normal.begin() + ptrdiff_t(voxels)));
    voxels += v.size();
    begin = d->end;
  }
  EXPECT_EQ(voxels, whole.size());
  EXPECT_EQ(pieces, 3);
}

TEST_F(Answers, OfANewTransferFunctionHaveOnlyWhatLacks) {
  const auto& levels = store->session().levels;
  follow(1, "100:#ffffff:0, 100:#ffffff:1, 150:#ffffff:1, 150:#ffffff:0");
  ASSERT_TRUE(weights());
  ASSERT_TRUE(ask(request(1, 5, 9)));
  const auto first = data();
  ASSERT_TRUE(first);
  const auto old = decoded(*first);
  EXPECT_TRUE(first->have.size() == 0 ||
              volume::LevelSet::from_bytes({reinterpret_cast<const uint8_t*>(first->have.data()), first->have.size()})
                  ->empty());
  const std::string wider = "80:#ffffff:0, 80:#ffffff:1, 120:#ffffff:1, 120:#ffffff:0";
  follow(2, wider);
  ASSERT_TRUE(weights());
  auto again = request(2, 5, 9);
  again.have = first->shown;
  ASSERT_TRUE(ask(again));
  const auto second = data();
  ASSERT_TRUE(second);
  const auto added = decoded(*second);
  for (const uint16_t l : added.level) ASSERT_TRUE(l >= 80 && l < 100) << l;
  EXPECT_EQ(std::vector(second->have.begin(), second->have.end()),
            std::vector(first->shown.begin(), first->shown.end()));
  // The two answers together have all levels that the second one lists.
  const auto shown =
      *volume::LevelSet::from_bytes({reinterpret_cast<const uint8_t*>(second->shown.data()), second->shown.size()});
  EXPECT_TRUE(shown.contains(shown_levels(*volume::parse_transfer(wider, {}), levels)));
  EXPECT_TRUE(shown.has(140));
  EXPECT_EQ(volume::merge(old, added), *store->voxels(0, 5, 9, shown, {}));
}

TEST_F(Answers, ServeEarlierRoundsFirst) {
  follow(1);
  weights();
  ASSERT_TRUE(ask(request(1, 0, 1, 2), "late"));
  ASSERT_TRUE(ask(request(1, 1, 2, 0), "first"));
  ASSERT_TRUE(ask(request(1, 2, 3, 1), "middle"));
  ASSERT_TRUE(ask(request(1, 3, 4, 0), "second"));
  for (const char* expected : {"first", "second", "middle", "late"}) {
    std::string peer;
    ASSERT_TRUE(data(&peer));
    EXPECT_EQ(peer, expected);
  }
  EXPECT_FALSE(answers.has_work());
  EXPECT_FALSE(answers.work(kSelf));
}

TEST_F(Answers, UnknownEpochsAreAnsweredAtOnceAndOldOnesForgotten) {
  EXPECT_FALSE(ask(request(1, 0, 5)));
  for (uint64_t epoch = 1; epoch <= kEpochsKept + 1; ++epoch) follow(epoch);
  EXPECT_FALSE(ask(request(1, 0, 5)));
  EXPECT_TRUE(ask(request(2, 0, 5)));
  EXPECT_FALSE(ask(request(99, 0, 5)));
  // A new master counts from 1 again.
  auto other = welcome_of(*store, 1);
  other.master = InstanceId{4};
  ASSERT_TRUE(answers.follow(other));
  EXPECT_FALSE(ask(request(5, 0, 5)));
  EXPECT_TRUE(ask(request(1, 0, 5)));
}

TEST_F(Answers, OfOnePeerWaitInBoundedNumber) {
  follow(1);
  weights();
  for (uint64_t n = 0; n < 3 * kRequestsAPeer; ++n) ASSERT_TRUE(ask(request(1, n, n + 1)));
  for (uint64_t n = 2 * kRequestsAPeer; n < 3 * kRequestsAPeer; ++n) EXPECT_EQ(data()->begin, n);
  EXPECT_FALSE(answers.has_work());
  size_t taken = 0;
  for (size_t peer = 0; peer < kRequestsWaiting + 10; ++peer) taken += ask(request(1, 0, 1), std::to_string(peer));
  EXPECT_EQ(taken, kRequestsWaiting);
}

TEST_F(Answers, RefuseNonsense) {
  follow(1);
  for (const auto& [begin, end] :
       {std::pair<uint64_t, uint64_t>{5, 5}, {6, 5}, {0, 201}, {~0ull, ~0ull}, {1ull << 32, (1ull << 32) + 1}})
    EXPECT_FALSE(answers.ask("a", request(1, begin, end))) << begin << " " << end;
  auto step = request(1, 0, 1);
  step.step = 1;
  EXPECT_FALSE(answers.ask("a", step));
  const std::byte few[3]{};
  auto have = request(1, 0, 1);
  have.have = few;
  EXPECT_FALSE(answers.ask("a", have));
}

TEST_F(Answers, FollowOnlyTheirOwnVolume) {
  auto mesh = welcome_of(*store, 1);
  mesh.facts["kind"] = "mesh";
  EXPECT_FALSE(answers.follow(mesh));
  auto other = welcome_of(*store, 1);
  other.parameters["volume.size.x"] = 10;
  EXPECT_FALSE(answers.follow(other));
  auto nothing = welcome_of(*store, 1);
  nothing.facts.clear(), nothing.parameters.clear();
  EXPECT_TRUE(answers.follow(nothing)) << "the master does not know the scene yet";
  EXPECT_FALSE(answers.has_work());
}

TEST(VolumeParts, AnswerForTheirOwnSlices) {
  const auto store = open_or_fail(noise(3, {9, 7, 10}), {.part = "1/2"});
  VolumeAnswers answers(*store);
  ASSERT_TRUE(answers.follow(welcome_of(*store, 1)));
  const auto weights = answers.work(kSelf);
  ASSERT_TRUE(weights);
  EXPECT_EQ(wire::decode<wire::SliceWeights>(std::as_bytes(std::span(weights->body)))->begin, 5u);
  EXPECT_EQ(wire::decode<wire::SliceWeights>(std::as_bytes(std::span(weights->body)))->voxels.size(), 5u);
  wire::VoxelRequest request;
  request.epoch = EpochId{1}, request.begin = 3, request.end = 8;
  ASSERT_FALSE(*answers.ask("a", request));
  const auto reply = answers.work(kSelf);
  const auto d = *wire::decode<wire::VoxelData>(std::as_bytes(std::span(reply->body)));
  EXPECT_TRUE(d.known);
  EXPECT_EQ(d.begin, 5u);
  EXPECT_EQ(d.end, 8u);
  request.end = 5;
  const auto none = answers.ask("a", request);
  ASSERT_TRUE(none && *none);
  EXPECT_FALSE(wire::decode<wire::VoxelData>(std::as_bytes(std::span((*none)->body)))->known);
}

}  // namespace
}  // namespace telesplat::data
