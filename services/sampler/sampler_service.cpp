#include "services/sampler/sampler_service.h"

#include <CLI/CLI.hpp>
#include <cstring>
#include <deque>
#include <optional>

#include "common/codec/depth_codec.h"
#include "common/core/clock.h"
#include "common/metrics/recorder.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "services/sampler/chunk_cache.h"
#include "services/sampler/sampler.h"

namespace telesplat::sampler {
namespace {

constexpr size_t kChunksInFlight = 8;  // requests to the data server not yet answered
constexpr int kLeasesAhead = 2;        // one being sampled, one to go on with at once
constexpr double kRetry_s = 2.0;       // a data server that does not answer is asked again

// Chunk bytes must be 4-byte aligned to be used in place; a received field may lie anywhere.
geometry::ChunkBytes aligned(const net::Message& message, wire::Bytes data) {
  if (reinterpret_cast<uintptr_t>(data.data()) % 16 == 0) return {data, message.owner};
  auto copy = std::make_shared<std::vector<std::byte>>(data.begin(), data.end());
  return {*copy, copy};
}

class SamplerService {
 public:
  SamplerService(const SamplerServiceOptions& o, std::unique_ptr<Sampler> sampler, net::Context& context)
      : options_(o),
        context_(context),
        sampler_(std::move(sampler)),
        cache_(uint64_t(o.chunk_cache_mb * 1e6)),
        link_(context, o.service.master, make_hello(o, *sampler_)) {}

  int serve() {
    while (!net::stop_requested() && !link_.shutdown_requested()) {
      const double now = monotonic_s();
      link_.tick(now, [&] { return status(); });
      flush_metrics(now);
      connect_if_changed();
      fetch(now);
      ask_for_leases();
      // With a tile to sample there is nothing to wait for.
      const bool ready = !leases_.empty() && cache_.known() && tiles_ &&
                         cache_.missing(geometry::crop(leases_.front().camera, leases_.front().rect)).empty();
      std::vector<net::Socket*> sockets{&link_.socket()};
      if (blocks_) sockets.push_back(&*blocks_);
      if (!ready) net::wait_readable(sockets, 50);
      receive_control();
      receive_chunks();
      if (ready && !leases_.empty()) sample_next();
    }
    flush_metrics(1e300);
    link_.leave([&] { return status(); });
    return 0;
  }

 private:
  static wire::Hello make_hello(const SamplerServiceOptions& o, const Sampler& s) {
    wire::Hello hello;
    hello.role = "sampler";
    hello.name = o.service.name;
    hello.facts = {{"sampler", s.name()}, {"threads", std::to_string(o.threads)}};
    return hello;
  }

  net::MasterLink::Values status() const {
    return {{"rss_mb", net::resident_mb()},
            {"peak_rss_mb", net::peak_resident_mb()},
            {"tiles_sampled", double(tiles_sampled_)},
            {"chunk_mb", double(cache_.bytes()) / 1e6},
            {"messages_rejected", blocks_ ? double(blocks_->rejected()) : 0.0}};
  }

  void flush_metrics(double now_s) {
    if (now_s - last_flush_s_ < 1.0) return;
    last_flush_s_ = now_s;
    if (const auto rows = spans_.flush(link_.instance())) link_.socket().send(*rows);
  }

  // (Re)connects to data server and packer when the session names new ones.
  void connect_if_changed() {
    if (link_.version() == seen_version_) return;
    seen_version_ = link_.version();
    const auto& session = *link_.session();
    const auto endpoint = [&](const char* key) {
      const auto it = session.endpoints.find(key);
      return it == session.endpoints.end() ? std::string() : it->second;
    };
    if (session.master != master_) {  // another master knows nothing of the leases we asked for
      master_ = session.master;
      leases_asked_ = 0;
      leases_.clear();
    }
    if (const std::string tiles = endpoint("tiles"); tiles != tiles_endpoint_ && !tiles.empty()) {
      tiles_endpoint_ = tiles;
      tiles_.emplace(context_, net::Kind::kPush, options_.service.name + ":tiles",
                     net::SocketOptions{.high_water_mark = 64});
      if (const Status s = tiles_->connect(tiles); !s) log::error("{}", s.error().text);
    }
    const std::string hash = session.facts.contains("content_hash") ? session.facts.at("content_hash") : "";
    if (const std::string chunks = endpoint("chunks");
        !chunks.empty() && (chunks != chunks_endpoint_ || session.epoch != epoch_)) {
      chunks_endpoint_ = chunks;
      epoch_ = session.epoch;
      blocks_.emplace(context_, net::Kind::kDealer, options_.service.name + ":chunks",
                      net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes});
      if (const Status s = blocks_->connect(chunks); !s) log::error("{}", s.error().text);
      // A restarted data server with the same data has the same chunks: keep what we hold.
      if (hash.empty() || hash != content_hash_) {
        for (const auto& c : cache_.chunks()) sampler_->remove_chunk(c.id);
        cache_.reset({});
        content_hash_ = hash;
        prefetched_ = false;
      }
      cache_.forget_waiting();
      last_request_s_ = -1e9;
    }
  }

  // Asks for the list of chunks, then for what the next tile needs, then for the rest as far as the budget goes.
  void fetch(double now_s) {
    if (!blocks_) return;
    if (!cache_.known()) {
      if (now_s - last_request_s_ > kRetry_s) {
        blocks_->send(wire::ChunkListRequest{epoch_});
        last_request_s_ = now_s;
      }
      return;
    }
    if (cache_.waiting_count() && now_s - last_request_s_ > kRetry_s) cache_.forget_waiting();
    std::vector<ChunkId> wanted;
    if (!leases_.empty()) {
      wanted = cache_.missing(geometry::crop(leases_.front().camera, leases_.front().rect));
      if (!wanted.empty() && now_s - last_extend_s_ > 0.1) {
        link_.socket().send(wire::LeaseExtend{link_.instance(), leases_.front().lease});
        last_extend_s_ = now_s;
      }
    }
    if (wanted.empty() && !prefetched_) {
      wanted = cache_.prefetch();
      if (wanted.empty()) {
        prefetched_ = true;
        log::info("{} of {} chunks held ({:.0f} MB)", cache_.chunks().size() - missing_count(), cache_.chunks().size(),
                  double(cache_.bytes()) / 1e6);
      }
    }
    for (const ChunkId id : wanted) {
      if (cache_.waiting_count() >= kChunksInFlight) break;
      if (cache_.waiting(id)) continue;
      blocks_->send(wire::ChunkRequest{epoch_, id});
      cache_.mark_waiting(id);
      last_request_s_ = now_s;
    }
  }
  size_t missing_count() const {
    size_t n = 0;
    for (const auto& c : cache_.chunks()) n += !cache_.held(c.id);
    return n;
  }

  void ask_for_leases() {
    // A lease may have to wait for its chunks, but then they come first: the earliest tiles need not wait for the whole mesh.
    if (!cache_.known() || !tiles_) return;
    while (leases_asked_ + int(leases_.size()) < kLeasesAhead) {
      link_.socket().send(wire::LeaseRequest{link_.instance()});
      ++leases_asked_;
    }
  }

  void receive_control() {
    while (const auto message = link_.socket().receive()) {
      if (link_.handle(*message, monotonic_s())) {
        if (message->type == wire::WhoAreYou::kName) leases_asked_ = 0;
        continue;
      }
      net::dispatch<wire::Lease>(link_.socket(), *message, [&](const wire::Lease& lease) {
        leases_asked_ = std::max(0, leases_asked_ - 1);
        leases_.push_back(lease);
      });
    }
  }

  void receive_chunks() {
    if (!blocks_) return;
    std::vector<std::pair<ChunkId, geometry::ChunkBytes>> batch;
    while (const auto message = blocks_->receive()) {
      net::dispatch<wire::ChunkList, wire::Chunk>(*blocks_, *message, [&](const auto& m) {
        if (m.epoch != epoch_) return;
        if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::ChunkList>) {
          if (!cache_.known()) cache_.reset(m.chunks);
        } else if (!m.data.empty() && cache_.waiting(m.chunk)) {
          batch.emplace_back(m.chunk, aligned(*message, m.data));
        }
      });
      if (batch.size() >= kChunksInFlight) break;
    }
    if (batch.empty()) return;
    const double begin = monotonic_s();
    for (const auto& [id, bytes] : batch)
      for (const ChunkId old : cache_.insert(id)) sampler_->remove_chunk(old);
    if (const Status s = sampler_->add_chunks(std::move(batch)); !s)
      log::warn("a chunk from {} was refused: {}", chunks_endpoint_, s.error().text);
    spans_.add("add chunks", link_.to_master_s(begin), link_.to_master_s(monotonic_s()));
  }

  void sample_next() {
    const wire::Lease lease = leases_.front();
    leases_.pop_front();
    ask_for_leases();  // the answer comes while we sample
    wire::DepthTile tile{link_.instance(), lease};
    tile.sample_begin_s = link_.to_master_s(monotonic_s());
    const image::DepthImage image = sampler_->sample(lease.camera, lease.rect);
    tile.sample_end_s = link_.to_master_s(monotonic_s());
    const auto stream = codec::encode(image);
    tile.encode_end_s = link_.to_master_s(monotonic_s());
    tile.image = std::as_bytes(std::span(stream));
    std::string body = wire::encode(tile);
    ++tiles_sampled_;
    spans_.add("sample", tile.sample_begin_s, tile.sample_end_s);
    spans_.add("encode", tile.sample_end_s, tile.encode_end_s);
    // A packer that is slow or being restarted: hold this tile for a while, then let its lease expire.
    for (int tries = 0; tries < 40 && !tiles_->send_frames({}, wire::DepthTile::kName, body); ++tries) {
      net::wait_readable({&link_.socket()}, 25);
      receive_control();
      if (net::stop_requested() || link_.shutdown_requested()) return;
    }
  }

  const SamplerServiceOptions& options_;
  net::Context& context_;
  std::unique_ptr<Sampler> sampler_;
  ChunkCache cache_;
  net::MasterLink link_;
  std::optional<net::Socket> blocks_, tiles_;
  std::string tiles_endpoint_, chunks_endpoint_, content_hash_;
  InstanceId master_;
  EpochId epoch_;
  std::deque<wire::Lease> leases_;
  metrics::SpanRecorder spans_;
  int leases_asked_ = 0, seen_version_ = 0;
  bool prefetched_ = false;
  uint64_t tiles_sampled_ = 0;
  double last_request_s_ = -1e9, last_extend_s_ = -1e9, last_flush_s_ = 0;
};

}  // namespace

void add_flags(CLI::App& app, SamplerServiceOptions& o) {
  net::add_service_flags(app, o.service, net::Ends::kConnects);
  app.add_option("--sampler", o.kind, "ray (Embree), raster (OpenGL), or auto: raster on a GPU, else ray")
      ->capture_default_str()
      ->check(CLI::IsMember({"auto", "ray", "raster"}));
  app.add_option("--threads", o.threads, "threads to sample with; 0: one a core")
      ->capture_default_str()
      ->check(CLI::Range(0, 1024));
  app.add_option("--chunk-cache-mb", o.chunk_cache_mb, "memory for chunks, MB")
      ->capture_default_str()
      ->check(CLI::Range(1.0, 1e6));
}

int run(const SamplerServiceOptions& o) {
  log::initialise(o.service.name, o.service.log_level);
  net::install_signal_handlers();
  auto sampler = make_sampler(o.kind, o.threads);
  if (!sampler) {
    log::error("{}", sampler.error().text);
    return 1;
  }
  net::Context context;
  return SamplerService(o, std::move(*sampler), context).serve();
}

}  // namespace telesplat::sampler
