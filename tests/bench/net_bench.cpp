// Messages as large as tiles over loopback, in the clear and encrypted: times of a sampler and the packer. MB/s: bodies
// that arrived. ms: from giving one to the socket until it is received, one at a time.
#include <benchmark/benchmark.h>
#include <unistd.h>

#include <filesystem>
#include <optional>
#include <string>

#include "common/net/keys/access.h"
#include "common/net/keys/key_maker.h"
#include "common/net/socket.h"

namespace telesplat::net {
namespace {

constexpr int kWait_ms = 2000;

/// Keys that the destructor deletes.
class BenchKeys {
 public:
  BenchKeys() : path_(std::filesystem::temp_directory_path() / ("telesplat-bench-keys-" + std::to_string(getpid()))) {
    std::filesystem::remove_all(path_);
    auto maker = KeyMaker::open(path_);
    CHECK(maker.ok() && maker->make_missing().ok());
  }
  ~BenchKeys() { std::filesystem::remove_all(path_); }
  Access of(Role role, bool binds) const {
    auto access = Access::open({}, path_, {role}, binds);
    CHECK(access.ok());
    return *std::move(access);
  }

 private:
  std::string path_;
};

/// A sampler's end and the packer's.
struct Ends {
  explicit Ends(const BenchKeys* keys)
      : packer(keys ? keys->of(Role::kPacker, true) : Access()),
        sampler(keys ? keys->of(Role::kSampler, false) : Access()),
        pull(packer, Kind::kPull, "tiles", {.max_message_bytes = 64u << 20, .serves = "tiles"}),
        push(sampler, Kind::kPush, "sampler") {
    const auto endpoint = pull.bind("tcp://127.0.0.1:*");
    CHECK(endpoint.ok() && push.connect(*endpoint).ok());
  }
  Context packer, sampler;
  Socket pull, push;
};

// Keeps `ahead` messages under way at once. False: a message did not arrive.
bool pass(Ends& ends, const std::string& tile, int ahead) {
  for (int i = 0; i < ahead; ++i)
    while (!ends.push.send_frames({}, "depth_tile", tile)) wait_readable({&ends.pull}, 1);
  for (int got = 0; got < ahead;) {
    if (!wait_readable({&ends.pull}, kWait_ms)) return false;
    while (got < ahead && ends.pull.receive()) ++got;
  }
  return true;
}

void send_tiles(benchmark::State& state, bool encrypted, int ahead) {
  std::optional<BenchKeys> keys;
  if (encrypted) keys.emplace();
  Ends ends(keys ? &*keys : nullptr);
  const std::string tile(size_t(state.range(0)), 'x');
  if (!pass(ends, tile, 1)) return state.SkipWithError("nothing arrives");  // from here on the connection exists
  for (auto _ : state)
    if (!pass(ends, tile, ahead)) return state.SkipWithError("a tile is lost");
  const auto bytes = double(state.iterations()) * double(ahead) * double(tile.size());
  state.counters["MB/s"] = benchmark::Counter(bytes * 1e-6, benchmark::Counter::kIsRate);
}

void register_all() {
  for (const bool encrypted : {false, true})
    for (const auto& [name, ahead] : {std::pair{"one", 1}, {"stream", 16}})
      benchmark::RegisterBenchmark((std::string("net/tile/") + name + (encrypted ? "/curve" : "/plain")).c_str(),
                                   [encrypted, ahead = ahead](benchmark::State& s) { send_tiles(s, encrypted, ahead); })
          ->Arg(16 << 10)
          ->Arg(128 << 10)
          ->Arg(1 << 20)
          ->UseRealTime()
          ->Unit(benchmark::kMillisecond);
}
[[maybe_unused]] const bool registered = (register_all(), true);

}  // namespace
}  // namespace telesplat::net
