// A sampler's work for leases of a volume: voxels from data servers that answer late, in part or twice, slabs that
// change, epochs, memory.
#include <gtest/gtest.h>

#include <deque>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <set>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "services/sampler/volume/work.h"
#include "tests/support/patience.h"

namespace telesplat::sampler {
namespace {

using volume::LevelSet;
using volume::Voxels;
using State = Readiness::State;

constexpr double kDeadline_s = test::patient(20);
constexpr int kSize[3] = {20, 16, 12};

int level_at(int step, int i, int j, int k) { return (i * 7 + j * 5 + k * 3 + step * 11) % 16; }

volume::Session session(const std::string& transfer, int step = 0, int steps = 1) {
  volume::Session s;
  s.grid.size = {kSize[0], kSize[1], kSize[2]};
  s.grid.index_to_room = glm::scale(glm::translate(glm::dmat4(1), {-0.1, -0.08, -0.06}), glm::dvec3(0.01));
  s.levels = {0, 1, 16};
  s.range = {0, 15, 0, 15, false};
  s.transfer = *volume::parse_transfer(transfer, s.range);
  s.lit = false;
  s.step = step, s.steps = steps;
  return s;
}
const char* kHigh = "9:#ffffff:0, 10:#ffffff:0.5, 15:#ffffff:1";
const char* kMore = "4:#ffffff:0, 5:#ffffff:0.5, 15:#ffffff:1";
const char* kLow = "0:#ffffff:0, 1:#ffffff:0.5, 3:#ffffff:0.5, 4:#ffffff:0";

LevelSet shown(const volume::Session& s) {
  LevelSet out;
  const auto colours = volume::level_colours(s.transfer, s.levels);
  for (size_t l = 0; l < colours.size(); ++l)
    if (colours[l].extinction > 0) out.add(int(l));
  return out;
}

Voxels voxels(int step, int begin, int end, const LevelSet& show, const LevelSet& have = {}) {
  Voxels v;
  v.k_begin = begin, v.k_end = end;
  v.rows.push_back(0);
  for (int k = begin; k < end; ++k)
    for (int j = 0; j < kSize[1]; ++j) {
      for (int i = 0; i < kSize[0]; ++i) {
        const int l = level_at(step, i, j, k);
        if (show.has(l) && !have.has(l)) v.i.push_back(uint16_t(i)), v.level.push_back(uint16_t(l));
      }
      v.rows.push_back(uint32_t(v.i.size()));
    }
  return v;
}

wire::Welcome welcome(EpochId epoch, const volume::Session& s, InstanceId master = {7}) {
  wire::Welcome w;
  w.master = master;
  w.epoch = epoch;
  w.parameters = volume::to_parameters(s);
  w.facts = volume::to_facts(s);
  w.facts["kind"] = "volume";
  return w;
}

// A data server that answers on the test's order.
struct FakeData {
  explicit FakeData(net::Context& context) : socket(context, net::Kind::kRouter, "data") {
    const auto bound = socket.bind("tcp://127.0.0.1:*");
    EXPECT_TRUE(bound);
    endpoint = *bound;
  }
  struct Request {
    std::string peer;
    uint64_t epoch, step, begin, end, round;
    LevelSet have;
  };
  void receive() {
    while (const auto message = socket.receive())
      net::dispatch<wire::VoxelRequest>(socket, *message, [&](const wire::VoxelRequest& r) {
        LevelSet have;
        if (!r.have.empty())
          have = *LevelSet::from_bytes({reinterpret_cast<const uint8_t*>(r.have.data()), r.have.size()});
        requests.push_back({message->peer, r.epoch.value, r.step, r.begin, r.end, r.round, have});
      });
  }
  void answer(const Request& r, uint64_t begin, uint64_t end, const LevelSet& show, bool known = true) {
    const Voxels v = voxels(int(r.step), int(begin), int(end), show, r.have);
    send(r, begin, end, show, volume::encode_voxels(v, kSize[0], kSize[1]), known);
  }
  void send(const Request& r, uint64_t begin, uint64_t end, const LevelSet& show, const std::vector<uint8_t>& bytes,
            bool known = true) {
    wire::VoxelData d{.epoch = {r.epoch}, .step = r.step, .begin = begin, .end = end, .known = known};
    if (!r.have.empty()) d.have = std::as_bytes(r.have.bytes());
    d.shown = std::as_bytes(show.bytes());
    d.data = std::as_bytes(std::span(bytes));
    EXPECT_TRUE(socket.send(d, r.peer));
  }
  net::Socket socket;
  std::string endpoint;
  std::deque<Request> requests;
};

struct FakeSlab final : Slab {
  explicit FakeSlab(Voxels v) : voxels(std::move(v)) {}
  size_t bytes() const override { return voxels.size() * 8; }
  std::vector<volume::SliceImage> splat(const std::vector<volume::LevelColour>& colours, const volume::ShearFrame& f,
                                        int k_begin, int k_end, const geometry::Clip&, uint64_t& count) const override {
    count = 0;
    for (const uint16_t l : voxels.level) count += colours[l].extinction > 0;
    std::vector<volume::SliceImage> out;
    for (int layer = 0; layer < int(f.layers.size()); ++layer)
      out.push_back(
          {layer, k_begin, k_end, {layer, 1, 5, 4}, std::vector<uint32_t>(20, 0xff000000u + unsigned(layer))});
    return out;
  }
  Voxels voxels;
};

class VolumeWorkTest : public testing::Test {
 protected:
  VolumeWork make(double cache_bytes = 1e9) {
    return {[this](const volume::Grid&, Voxels v) {
              made.push_back(std::make_shared<const FakeSlab>(std::move(v)));
              return made.back();
            },
            {.threads = 1, .cache_bytes = uint64_t(cache_bytes), .service_name = "sampler"},
            context,
            {{5},
             [this](const wire::SlabReady& m) { ready.push_back(m); },
             [this](const wire::LeaseExtend& m) { extended.push_back(m.lease.value); },
             [](double s) { return s + 1000; }},
            spans};
  }
  template <class M>
  void tell(VolumeWork& work, const M& m) {
    const auto body = std::make_shared<std::string>(wire::encode(m));
    work.take(control, {"", std::string(M::kName), std::as_bytes(std::span(*body)), body}, true, now);
  }
  wire::SlabAssignment slab(uint64_t partition, int begin, int end) {
    wire::SlabAssignment a{partition, 0, 2, uint64_t(begin), uint64_t(end), {}};
    const int b = std::max(begin - 1, 0), e = std::min(end + 1, kSize[2]);
    if (begin < end) a.sheet = {{0, data.endpoint, uint64_t(b), uint64_t(e)}};
    return a;
  }
  wire::SliceLease lease(uint64_t id, EpochId epoch, int begin, int end, const volume::Session& s) {
    const auto camera = geometry::make_camera({{0, 0, 0.5}, {1, 0, 0, 0}}, 60, 64, 48);
    wire::SliceLease l{.lease = {id}, .frame = {id}, .epoch = epoch, .partition = 1, .slab = 0, .slabs = 1};
    l.begin = uint64_t(begin), l.end = uint64_t(end);
    l.shear = *volume::plan_frame(s.grid, std::span(&camera, 1));
    l.views = {{{9}, {3}, camera, 0}};
    return l;
  }
  // Passes messages on until `done`.
  bool until(VolumeWork& work, const auto& done) {
    for (const double deadline = monotonic_s() + kDeadline_s; monotonic_s() < deadline;) {
      work.fetch(now);
      data.receive();
      other.receive();
      if (done()) return true;
      std::vector<net::Socket*> sockets = work.sockets();
      sockets.push_back(&data.socket), sockets.push_back(&other.socket);
      net::wait_readable(sockets, 5);
      work.receive(now);
    }
    return false;
  }
  bool asked(VolumeWork& work) {
    return until(work, [&] { return !data.requests.empty(); });
  }
  FakeData::Request take_request() {
    const auto r = data.requests.front();
    data.requests.pop_front();
    return r;
  }
  // Answers every request until the sampler is ready.
  bool serve(VolumeWork& work, const LevelSet& show) {
    const size_t before = ready.size();
    return until(work, [&] {
      for (FakeData* d : {&data, &other})
        for (; !d->requests.empty(); d->requests.pop_front())
          d->answer(d->requests.front(), d->requests.front().begin, d->requests.front().end, show);
      return ready.size() > before;
    });
  }

  net::Context context;
  net::Socket control{context, net::Kind::kDealer, "control"};
  FakeData data{context}, other{context};
  metrics::SpanRecorder spans;
  std::vector<std::shared_ptr<const FakeSlab>> made;
  std::vector<wire::SlabReady> ready;
  std::vector<uint64_t> extended;
  double now = 100;
};

TEST_F(VolumeWorkTest, FetchesTheSlabAndASliceMoreByTheSheetOneRequestAtATime) {
  auto work = make();
  const auto s = session(kHigh);
  EXPECT_FALSE(work.takes_leases());
  work.on_welcome(welcome({1}, s));
  EXPECT_TRUE(work.takes_leases());
  auto a = slab(1, 4, 8);
  a.sheet = {{2, data.endpoint, 3, 5}, {0, data.endpoint, 7, 9}, {1, other.endpoint, 5, 7}};
  tell(work, a);
  ASSERT_TRUE(asked(work));
  EXPECT_TRUE(other.requests.empty());
  auto r = take_request();
  EXPECT_EQ(r.begin, 7u);
  EXPECT_EQ(r.end, 9u);
  EXPECT_EQ(r.round, 0u);
  EXPECT_TRUE(r.have.empty());
  data.answer(r, 7, 9, shown(s));
  ASSERT_TRUE(until(work, [&] { return !other.requests.empty(); }));
  EXPECT_TRUE(data.requests.empty());
  r = other.requests.front();
  EXPECT_EQ(r.begin, 5u);
  EXPECT_EQ(r.end, 7u);
  EXPECT_EQ(r.round, 1u);
  other.answer(r, 5, 6, shown(s));  // only a part: the sampler asks for the rest
  other.requests.clear();
  ASSERT_TRUE(until(work, [&] { return !other.requests.empty(); }));
  EXPECT_EQ(other.requests.front().begin, 6u);
  other.answer(other.requests.front(), 6, 7, shown(s));
  ASSERT_TRUE(asked(work));
  EXPECT_TRUE(ready.empty());
  data.answer(take_request(), 3, 5, shown(s));
  ASSERT_TRUE(until(work, [&] { return !ready.empty(); }));
  EXPECT_EQ(ready[0].sampler.value, 5u);
  EXPECT_EQ(ready[0].partition, 1u);
  EXPECT_EQ(ready[0].epoch.value, 1u);
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0]->voxels, voxels(0, 3, 9, shown(s)));
  EXPECT_EQ(ready[0].voxels, made[0]->voxels.size());
  EXPECT_GT(ready[0].bytes, 0u);
}

TEST_F(VolumeWorkTest, AsksAgainAfterSilenceAndAfterServersThatDoNotKnow) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 12));
  ASSERT_TRUE(asked(work));
  const auto first = take_request();
  EXPECT_EQ(first.begin, 0u);
  EXPECT_EQ(first.end, 12u);
  now += RetryClock::kFirst_s * 0.9;
  work.fetch(now);
  now += RetryClock::kFirst_s * 0.2;
  ASSERT_TRUE(asked(work));
  const auto second = take_request();
  EXPECT_TRUE(data.requests.empty());
  data.answer(second, 0, 12, shown(s), false);
  ASSERT_TRUE(until(work, [&] { return work.sockets().size() == 1; }));
  const double paused = now;
  ASSERT_TRUE(until(work, [&] {
    now += VolumeWork::kPause_s / 5;
    return !data.requests.empty();
  }));
  EXPECT_GE(now, paused + VolumeWork::kPause_s);
  const auto third = take_request();
  data.answer(third, 0, 12, shown(s));
  data.answer(first, 0, 12, shown(s));  // late: dropped
  ASSERT_TRUE(until(work, [&] { return !ready.empty(); }));
  EXPECT_EQ(made.at(0)->voxels, voxels(0, 0, 12, shown(s)));
}

// Voxels that are asked for twice come twice and make a slow link slower.
TEST_F(VolumeWorkTest, ASlowAnswerIsAskedForOnce) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 12));
  for (int begin = 0; begin < 12; begin += 4) {
    ASSERT_TRUE(asked(work)) << begin;
    const auto request = take_request();
    EXPECT_EQ(request.begin, uint64_t(begin));
    for (int n = 0; n < 24; ++n) {
      now += 0.5;
      work.fetch(now);
    }
    net::wait_readable({&data.socket}, 50);
    data.receive();
    EXPECT_TRUE(data.requests.empty()) << "twelve seconds are not long for a slow link";
    data.answer(request, uint64_t(begin), uint64_t(begin) + 4, shown(s));
    ASSERT_TRUE(until(work, [&] { return !ready.empty() || !data.requests.empty(); }));
  }
}

TEST_F(VolumeWorkTest, ANewTransferFunctionBringsOnlyWhatIsMissing) {
  auto work = make();
  const auto high = session(kHigh), more = session(kMore), low = session(kLow);
  work.on_welcome(welcome({1}, high));
  tell(work, slab(1, 2, 10));
  ASSERT_TRUE(serve(work, shown(high)));
  work.on_welcome(welcome({2}, more));
  ASSERT_TRUE(asked(work));
  EXPECT_EQ(data.requests.front().have, shown(high));
  EXPECT_EQ(data.requests.front().epoch, 2u);
  ASSERT_TRUE(serve(work, shown(more)));
  EXPECT_EQ(ready.back().epoch.value, 2u);
  EXPECT_EQ(made.back()->voxels, voxels(0, 1, 11, shown(more)));
  // An epoch that changes nothing: the sampler neither asks for voxels nor arranges any.
  const size_t arranged = made.size();
  work.on_welcome(welcome({3}, high));
  ASSERT_TRUE(until(work, [&] { return ready.back().epoch.value == 3; }));
  EXPECT_EQ(made.size(), arranged);
  work.on_welcome(welcome({4}, low));
  ASSERT_TRUE(serve(work, shown(low)));
  LevelSet all = shown(more);
  all.add(shown(low));
  EXPECT_EQ(made.back()->voxels, voxels(0, 1, 11, all)) << "what is transparent now stays";
}

TEST_F(VolumeWorkTest, ALeaseWaitsForItsVoxelsAndIsExtendedMeanwhile) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 12));
  tell(work, lease(1, {1}, 0, 12, s));
  ASSERT_EQ(work.leases(), 1u);
  EXPECT_EQ(work.look_at_next(now).state, State::kWaits);
  ASSERT_TRUE(asked(work));
  for (int n = 0; n < 5; ++n) now += VolumeWork::kExtend_s * 0.6, work.fetch(now);
  EXPECT_GE(extended.size(), 2u);
  EXPECT_LE(extended.size(), 4u);
  now += RetryClock::kFirst_s + 1;
  const size_t before = extended.size();
  work.fetch(now);
  EXPECT_EQ(extended.size(), before) << "a server that never answers shall not hold a frame for ever";
  data.requests.clear();
  ASSERT_TRUE(asked(work));
  data.answer(take_request(), 0, 12, shown(s));
  ASSERT_TRUE(until(work, [&] { return work.look_at_next(now).state == State::kReady; }));
  const Delivery out = work.sample_next();
  EXPECT_EQ(work.leases(), 0u);
  ASSERT_EQ(out.type, wire::SliceImages::kName);
  const auto m = wire::decode<wire::SliceImages>(std::as_bytes(std::span(out.body)));
  ASSERT_TRUE(m) << m.error().text;
  EXPECT_EQ(m->sampler.value, 5u);
  EXPECT_EQ(m->lease.frame.value, 1u);
  EXPECT_EQ(m->voxels, voxels(0, 0, 12, shown(s)).size());
  EXPECT_GE(m->lease.moments.sample_begin_s, 1000);
  EXPECT_LE(m->lease.moments.sample_begin_s, m->lease.moments.sample_end_s);
  EXPECT_LE(m->lease.moments.sample_end_s, m->lease.moments.encode_end_s);
  const auto& shear = m->lease.shear;
  const auto slices = volume::parse_slices({reinterpret_cast<const uint8_t*>(m->data.data()), m->data.size()},
                                           shear.width, shear.height, int(shear.layers.size()));
  ASSERT_TRUE(slices) << slices.error().text;
  ASSERT_EQ(slices->size(), shear.layers.size());
  for (size_t l = 0; l < slices->size(); ++l) EXPECT_EQ(slices->at(l).layer, int(l)) << "in order of layers";
}

TEST_F(VolumeWorkTest, LeasesThatMakeNoSenseAreDropped) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 12));
  ASSERT_TRUE(serve(work, shown(s)));
  auto bad = lease(1, {1}, 0, 12, s);
  bad.shear.layers[0].end = 99;
  tell(work, bad);
  const uint64_t refused = control.rejected();
  bad = lease(2, {1}, 5, 5, s);
  tell(work, bad);
  EXPECT_EQ(control.rejected(), refused + 1) << "no such message";
  bad = lease(3, {1}, 5, 13, s);
  tell(work, bad);
  tell(work, lease(4, {1}, 0, 12, s));
  EXPECT_EQ(work.leases(), 3u);
  EXPECT_EQ(work.look_at_next(now).state, State::kReady);
  EXPECT_EQ(work.leases(), 1u);
  work.drop_leases();
  tell(work, lease(5, {2}, 0, 12, s));
  EXPECT_EQ(work.look_at_next(now + 0.5).state, State::kWaits);
  EXPECT_EQ(work.look_at_next(now + 1.1).state, State::kWaits) << "none is left";
  EXPECT_EQ(work.leases(), 0u);
  const uint64_t rejected = control.rejected();
  auto a = slab(2, 3, 5);
  a.end = 99;
  tell(work, a);
  a = slab(2, 3, 5);
  a.sheet[0].end = 13;
  tell(work, a);
  EXPECT_EQ(control.rejected(), rejected + 2);
}

TEST_F(VolumeWorkTest, BadScenesAreToldAndTheirLeasesDropped) {
  auto work = make();
  auto w = welcome({1}, session(kHigh));
  w.parameters.erase("volume.size.x");
  work.on_welcome(w);
  tell(work, lease(1, {1}, 0, 12, session(kHigh)));
  EXPECT_EQ(work.look_at_next(now).state, State::kWaits);
  EXPECT_EQ(work.leases(), 0u);
  work.fetch(now);
  EXPECT_TRUE(ready.empty());
}

TEST_F(VolumeWorkTest, TheOldPartitionIsServedUntilTheNewOneIsInUse) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 8));
  ASSERT_TRUE(serve(work, shown(s)));
  tell(work, lease(1, {1}, 0, 8, s));
  ASSERT_EQ(work.look_at_next(now).state, State::kReady);
  work.sample_next();
  tell(work, slab(2, 6, 12));
  ASSERT_TRUE(asked(work));
  EXPECT_EQ(data.requests.front().begin, 9u) << "what is held is not asked for again";
  tell(work, lease(2, {1}, 0, 8, s));
  ASSERT_EQ(work.look_at_next(now).state, State::kReady);
  work.sample_next();
  EXPECT_EQ(made.size(), 1u);
  // The same in a new epoch, whose voxels come by the old sheet.
  const auto more = session(kMore);
  work.on_welcome(welcome({2}, more));
  tell(work, lease(3, {2}, 0, 8, more));
  ASSERT_TRUE(until(work, [&] {
    for (; !data.requests.empty(); data.requests.pop_front()) {
      const auto& r = data.requests.front();
      data.answer(r, r.begin, r.end, shown(r.epoch == 1 ? s : more));
    }
    return work.look_at_next(now).state == State::kReady;
  }));
  work.sample_next();
  EXPECT_EQ(made.back()->voxels, voxels(0, 0, 9, shown(more)));
  ASSERT_TRUE(ready.back().partition == 2 || serve(work, shown(more)));
  EXPECT_EQ(ready.back().partition, 2u);
  EXPECT_EQ(ready.back().epoch.value, 2u);
  tell(work, lease(4, {2}, 6, 12, more));
  ASSERT_EQ(work.look_at_next(now).state, State::kReady);
  work.sample_next();
  // The new slab is in use: the arranged voxels of the old one are freed, its voxels are kept.
  tell(work, lease(5, {2}, 0, 8, more));
  ASSERT_EQ(work.look_at_next(now).state, State::kReady);
  const size_t arranged = made.size();
  work.sample_next();
  EXPECT_EQ(made.size(), arranged + 1);
}

TEST_F(VolumeWorkTest, ASpareIsReadyAtOnce) {
  auto work = make();
  work.on_welcome(welcome({1}, session(kHigh)));
  tell(work, slab(3, 0, 0));
  work.fetch(now);
  ASSERT_EQ(ready.size(), 1u);
  EXPECT_EQ(ready[0].partition, 3u);
  EXPECT_TRUE(made.empty());
  EXPECT_TRUE(work.sockets().empty());
}

TEST_F(VolumeWorkTest, LaterStepsAreFetchedAheadAsFarAsMemoryGoes) {
  const auto at = [&](int step) { return session(kHigh, step, 4); };
  const uint64_t of_a_step = voxels(0, 0, 12, shown(at(0))).size() * 14 + 12 * (4 * 17 + 1024);
  for (const int fit : {1, 3}) {
    auto work = make(double(of_a_step) * (fit + 0.6));
    ready.clear(), made.clear();
    work.on_welcome(welcome({1}, at(0)));
    tell(work, slab(1, 0, 12));
    ASSERT_TRUE(serve(work, shown(at(0))));
    std::set<uint64_t> steps;
    const size_t wanted = size_t(fit) - 1;
    ASSERT_TRUE(until(work, [&] {
      for (; !data.requests.empty(); data.requests.pop_front()) {
        const auto& r = data.requests.front();
        steps.insert(r.step);
        data.answer(r, r.begin, r.end, shown(at(0)));
      }
      return steps.size() >= wanted && made.size() >= wanted + 1;
    }));
    for (int n = 0; n < 20; ++n) work.fetch(now), data.receive(), work.receive(now);
    EXPECT_TRUE(data.requests.empty());
    EXPECT_EQ(steps.size(), wanted) << "from step 1 on";
    if (wanted > 0) {
      EXPECT_EQ(*steps.begin(), 1u);
      EXPECT_EQ(*steps.rbegin(), wanted);
    }
    if (fit < 3) continue;
    // The next step's voxels are already here.
    work.on_welcome(welcome({2}, at(1)));
    work.fetch(now);
    EXPECT_EQ(ready.back().epoch.value, 2u);
    net::MasterLink::Values values;
    work.add_status(values);
    EXPECT_LE(values["voxel_mb"] * 1e6, double(of_a_step) * (fit + 0.6));
  }
}

TEST_F(VolumeWorkTest, AnswersThatAreNoneDoNoHarm) {
  auto work = make();
  const auto high = session(kHigh), more = session(kMore);
  work.on_welcome(welcome({1}, high));
  tell(work, slab(1, 0, 12));
  ASSERT_TRUE(asked(work));
  auto r = take_request();
  const auto good = volume::encode_voxels(voxels(0, 0, 12, shown(high)), kSize[0], kSize[1]);
  std::mt19937_64 random(3);
  const auto refuse = [&](auto&& send) {
    send();
    work.receive(now);
    for (int n = 0; n < 3; ++n) {
      net::wait_readable(work.sockets(), 20);
      work.receive(now);
    }
    EXPECT_TRUE(ready.empty());
  };
  refuse([&] { data.send(r, 0, 12, shown(high), {}); });
  refuse([&] { data.send(r, 0, 13, shown(high), good); });
  refuse([&] { data.send(r, 0, 11, shown(high), good); });
  refuse([&] {
    auto other_step = r;
    other_step.step = 5;
    data.send(other_step, 0, 12, shown(high), good);
  });
  refuse([&] {
    auto other_have = r;
    other_have.have.add(3);
    data.send(other_have, 0, 12, shown(high), good);
  });
  auto lit = voxels(0, 0, 12, shown(high));
  lit.normal.assign(lit.size(), 5);
  refuse([&] { data.send(r, 0, 12, shown(high), volume::encode_voxels(lit, kSize[0], kSize[1])); });
  for (int n = 0; n < 20; ++n)
    refuse([&] { data.send(r, 0, 12, shown(high), {good.begin(), good.begin() + long(random() % good.size())}); });
  data.answer(r, 0, 12, shown(high));
  ASSERT_TRUE(until(work, [&] { return ready.size() == 1; }));
  // Sends the voxels that the sampler already has.
  work.on_welcome(welcome({2}, more));
  ASSERT_TRUE(asked(work));
  r = take_request();
  data.send(r, 0, 12, shown(more), volume::encode_voxels(voxels(0, 0, 12, shown(more)), kSize[0], kSize[1]));
  for (int n = 0; n < 5; ++n) net::wait_readable(work.sockets(), 20), work.receive(now), work.fetch(now);
  EXPECT_EQ(ready.size(), 1u);
  data.answer(r, 0, 12, shown(more));
  ASSERT_TRUE(until(work, [&] { return ready.size() == 2; }));
  EXPECT_EQ(made.back()->voxels, voxels(0, 0, 12, shown(more)));
  net::MasterLink::Values values;
  work.add_status(values);
  EXPECT_GE(values["messages_rejected"], 3);
}

TEST_F(VolumeWorkTest, AnotherVolumeOrMasterBeginsAnew) {
  auto work = make();
  const auto s = session(kHigh);
  work.on_welcome(welcome({1}, s));
  tell(work, slab(1, 0, 12));
  ASSERT_TRUE(serve(work, shown(s)));
  // Another master of the same volume: the voxels held are good for it.
  work.on_welcome(welcome({1}, s, {8}));
  tell(work, slab(1, 0, 12));
  work.fetch(now);
  EXPECT_EQ(ready.size(), 2u);
  auto larger = s;
  larger.grid.size[0] += 1;
  work.on_welcome(welcome({1}, larger, {8}));
  tell(work, slab(1, 0, 12));
  ASSERT_TRUE(asked(work));
  EXPECT_TRUE(take_request().have.empty());
}

TEST(SlabStore, AnswersMustHaveTheSlicesThatTheirHeaderSays) {
  const auto high = session(kHigh);
  const LevelSet show = shown(high);
  SlabStore store([](const volume::Grid&, Voxels v) { return std::make_shared<const FakeSlab>(std::move(v)); }, 1);
  store.set_scene({high.grid, high.levels, high.lit, 1, ""});
  ASSERT_TRUE(store.assign({1, 0, 1, 0, 12, {{0, "tcp://server:1", 0, 12}}}));
  const auto ask = store.next({0, 0, 12, {1}, &show});
  ASSERT_TRUE(ask && ask->begin == 0 && ask->end == 12);
  // The header says slices 2 to 10, the voxels are those of [begin, end).
  const auto take = [&](int begin, int end) {
    const auto bytes = volume::encode_voxels(voxels(0, begin, end, show), kSize[0], kSize[1]);
    wire::VoxelData d{.epoch = {1}, .begin = 2, .end = 10, .known = true};
    d.shown = std::as_bytes(show.bytes());
    d.data = std::as_bytes(std::span(bytes));
    return store.take(*ask, d, show);
  };
  for (const auto& [begin, end] : {std::pair{2, 2}, {10, 10}, {2, 9}, {3, 10}, {5, 6}}) {
    const auto taken = take(begin, end);
    ASSERT_FALSE(taken.ok()) << begin << " to " << end;
    const std::string& why = taken.error().text;
    EXPECT_NE(why.find("tcp://server:1"), std::string::npos) << why;
    EXPECT_NE(why.find("2 to 10"), std::string::npos) << why;
    EXPECT_NE(why.find(std::to_string(begin) + " to " + std::to_string(end)), std::string::npos) << why;
    EXPECT_EQ(store.voxels(), 0u);
  }
  const auto taken = take(2, 10);
  ASSERT_TRUE(taken.ok() && *taken);
  EXPECT_EQ(store.voxels(), voxels(0, 2, 10, show).size());
}

TEST(SlabStore, LetsGoOfWhatIsTransparentWhenMemoryRunsShort) {
  const auto high = session(kHigh), low = session(kLow);
  const LevelSet of_high = shown(high), of_low = shown(low);
  SlabStore store([](const volume::Grid&, Voxels v) { return std::make_shared<const FakeSlab>(std::move(v)); }, 1);
  store.set_scene({high.grid, high.levels, high.lit, 1, ""});
  ASSERT_TRUE(store.assign({1, 0, 1, 0, 12, {{0, "tcp://x:1", 0, 12}}}));
  const auto take = [&](EpochId epoch, const LevelSet& show) {
    const auto ask = store.next({0, 0, 12, epoch, &show});
    if (!ask) return false;
    const auto bytes = volume::encode_voxels(voxels(0, 0, 12, show, ask->have), kSize[0], kSize[1]);
    wire::VoxelData d{.epoch = epoch, .begin = 0, .end = 12, .known = true};
    if (!ask->have.empty()) d.have = std::as_bytes(ask->have.bytes());
    d.shown = std::as_bytes(show.bytes());
    d.data = std::as_bytes(std::span(bytes));
    const auto taken = store.take(*ask, d, show);
    return taken.ok() && *taken;
  };
  ASSERT_TRUE(take({1}, of_high));
  ASSERT_TRUE(take({2}, of_low));
  EXPECT_EQ(store.voxels(), voxels(0, 0, 12, of_high).size() + voxels(0, 0, 12, of_low).size());
  const auto slab = store.slab({0, 0, 12, {2}, &of_low});
  ASSERT_TRUE(slab);
  store.trim(0, of_low);
  EXPECT_EQ(store.voxels(), voxels(0, 0, 12, of_low).size());
  EXPECT_TRUE(store.holds({0, 0, 12, {2}, &of_low}));
  EXPECT_FALSE(store.holds({0, 0, 12, {1}, &of_high}));
  EXPECT_EQ(std::static_pointer_cast<const FakeSlab>(store.slab({0, 0, 12, {2}, &of_low}))->voxels,
            voxels(0, 0, 12, of_low));
  EXPECT_TRUE(take({3}, of_high)) << "asked for again when it is shown again";
}

}  // namespace
}  // namespace telesplat::sampler
