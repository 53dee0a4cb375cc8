#include "services/sampler/mesh/tiles.h"

#include <algorithm>
#include <glm/geometric.hpp>
#include <utility>

#include "common/net/dispatch.h"
#include "common/scene/clip_order.h"
#include "common/scene/session.h"

namespace telesplat::sampler {
namespace {

constexpr size_t kChunksInFlight = 8;         // requests to the data server not yet answered
constexpr uint64_t kBytesInFlight = 8 << 20;  // size of these chunks, unless it is one chunk
constexpr uint64_t kBytesBeside = 2 << 20;    // the same while there are tiles to be sampled
constexpr double kMostListPatience_s = 16;    // an array that is being read may take long
constexpr double kExtend_s = 0.1;             // between two requests for more time
constexpr double kPatience_s = 6.0;  // if nothing comes for this time, and for what the link needs: no more time

geometry::Rect all_of(const geometry::Camera& camera) { return {0, 0, camera.width, camera.height}; }

}  // namespace

MeshTiles::MeshTiles(std::unique_ptr<Sampler> sampler, uint64_t cache_bytes, const std::string& service_name,
                     net::Context& context, net::MasterLink& link, metrics::SpanRecorder& spans)
    : builder_(std::move(sampler)),
      cache_(cache_bytes),
      service_name_(service_name),
      context_(context),
      link_(link),
      spans_(spans) {}

void MeshTiles::learn_look(const wire::Welcome& session) {
  looks_.follow(session.master);
  const scene::SessionView view(session);
  Look look{.text = view.fact(scene::kColouringFact),
            .array = {},
            .colours = nullptr,
            .clip_text = view.fact(scene::kClipFact),
            .clip = {}};
  const Look* before = looks_.find(session.epoch);
  if (before && before->text == look.text && before->clip_text == look.clip_text) return;
  if (const auto clip = geometry::clip_from_text(look.clip_text)) {
    look.clip = *clip;
  } else {
    look.known = false;
    log::error("epoch {} cannot be sampled: {}", session.epoch.value, clip.error().text);
  }
  if (!look.text.empty()) {
    const auto colouring = scene::colouring_from_text(look.text);
    look.known &= colouring.ok();
    if (colouring) {
      look.array = colouring->array;
      look.colours = std::make_shared<const scene::ColourTable>(scene::make_table(*colouring));
    } else {
      log::error("epoch {} cannot be sampled: {}", session.epoch.value, colouring.error().text);
    }
  }
  looks_.put(session.epoch, std::move(look));
}

void MeshTiles::on_welcome(const wire::Welcome& session) {
  learn_look(session);
  patience_.follow(session.settings);
  const scene::SessionView view(session);
  const std::string chunks = view.endpoint("chunks");
  if (chunks.empty() || (chunks == endpoint_ && session.epoch == epoch_)) return;
  epoch_ = session.epoch;
  if (chunks != endpoint_) {
    endpoint_ = chunks;
    blocks_.emplace(context_, net::Kind::kDealer, service_name_ + ":chunks",
                    net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                                       .patience_s = net::kBulkPatience_s,
                                       .watch_connecting = true,
                                       .toward = "data"});
    failed_before_ = 0;
    if (const Status s = blocks_->connect(endpoint_); !s) log::error("{}", s.error().text);
  }
  // A restarted data server with the same data has the same chunks: keep what we hold.
  const std::string hash = view.fact("content_hash");
  const Look* look = looks_.find(session.epoch);
  if (hash.empty() || hash != content_hash_ || (look && look->array != array_)) {
    if (look) array_ = look->array;
    builder_.drop();
    for (const auto& c : cache_.chunks()) builder_.sampler().remove_chunk(c.id);
    cache_.reset({});
    content_hash_ = hash;
  }
  begin_anew();
}

// Forgets all open requests.
void MeshTiles::begin_anew() {
  cache_.forget_waiting();
  retry_.forget();
  list_clock_.forget();
  broken_ = false;
}

bool ListClock::ask(bool broken, double now_s) {
  if (now_s - asked_s_ <= (broken ? RetryClock::kLeast_s : patience_s_)) return false;
  if (asked_s_ > 0) patience_s_ = std::min(2 * patience_s_, kMostListPatience_s);
  asked_s_ = now_s;
  return true;
}

void MeshTiles::fetch_list(double now_s) {
  if (!list_clock_.ask(broken_, now_s)) return;
  blocks_->send(wire::ChunkListRequest{epoch_, array_});
  broken_ = false;
}

Readiness MeshTiles::readiness(const HeldLease& held, double now_s) {
  const Look* look = looks_.find(held.lease.epoch);
  if (!look) return looks_.wait_for_welcome(held.lease.epoch, held.received_s, now_s);
  if (!look->known || look->array != array_) return {Readiness::State::kHopeless};
  if (!cache_.known()) return {Readiness::State::kWaits};
  const Cut cut = cache_.cut(held.lease.camera, held.lease.rect);
  if (cut.fine) return {Readiness::State::kReady};
  const double until_s = patience_.until_s(held.lease, now_s);
  if (cut.whole && now_s >= until_s) return {Readiness::State::kReady};
  constexpr double kLook_s = 0.005;  // between two looks at chunks that are being prepared
  const double again_s = cut.whole ? until_s : 1e300;
  return {Readiness::State::kWaits, builder_.busy() ? std::min(again_s, now_s + kLook_s) : again_s};
}

Sampled MeshTiles::sample(const HeldLease& held) {
  const Look& look = *looks_.find(held.lease.epoch);
  builder_.sampler().set_colours(look.colours);
  builder_.sampler().set_clip(look.clip);
  // In the tile alone: where a chunk of another tile is missing, those above it may stand in for this tile's, too.
  const Cut cut = cache_.cut(held.lease.camera, held.lease.rect);
  builder_.sampler().show(cut.shown);
  Sampled out = timed([&] { return builder_.sampler().sample(held.lease.camera, held.lease.rect, held.pixels()); });
  out.coarse = !cut.fine;
  patience_.sampled(out.coarse);
  return out;
}

// Asks for more time for a lease whose chunks are not here, unless nothing has come for long.
void MeshTiles::extend(const HeldLease& next, double now_s) {
  const bool patient = now_s - std::max(progress_s_, next.received_s) < std::max(kPatience_s, retry_.patience_s());
  if (!patient || now_s - last_extend_s_ <= kExtend_s) return;
  link_.socket().send(wire::LeaseExtend{link_.instance(), next.lease.lease});
  last_extend_s_ = now_s;
}

// Asks for the list of chunks, then for chunks of the next tile, of the view around it, and for the rest as far as the
// budget goes: while there are tiles only of the highest levels.
void MeshTiles::fetch(const HeldLease* next, double now_s) {
  if (!blocks_) return;
  const uint64_t failed = blocks_->failed_connections();
  broken_ |= std::exchange(failed_before_, failed) != failed;
  if (!cache_.known()) {
    if (next) extend(*next, now_s);
    return fetch_list(now_s);
  }
  if (retry_.overdue(now_s, broken_)) begin_anew();
  std::vector<ChunkId> wanted;
  uint64_t most_bytes = kBytesInFlight;
  if (next) {
    Cut cut = cache_.cut(next->lease.camera, next->lease.rect);
    if (!cut.fine) extend(*next, now_s);
    if (cut.whole) most_bytes = kBytesBeside;
    wanted = std::move(cut.missing);
    if (wanted.empty()) wanted = cache_.cut(next->lease.camera, all_of(next->lease.camera)).missing;
  }
  if (wanted.empty()) wanted = cache_.prefetch(patience_.at_rest(next != nullptr, now_s));
  for (const ChunkId id : wanted) {
    if (cache_.waiting(id)) continue;
    if (cache_.waiting_count() >= kChunksInFlight ||
        (cache_.waiting_count() > 0 && cache_.waiting_bytes() + cache_.bytes_of(id) > most_bytes))
      break;
    blocks_->send(wire::ChunkRequest{epoch_, id, array_});
    cache_.mark_waiting(id);
    retry_.asked(cache_.bytes_of(id), now_s);
  }
}

std::vector<net::Socket*> MeshTiles::sockets() {
  return blocks_ ? std::vector<net::Socket*>{&*blocks_} : std::vector<net::Socket*>{};
}

void MeshTiles::receive() {
  if (!blocks_) return;
  const double now_s = monotonic_s();
  std::vector<std::pair<ChunkId, geometry::ChunkBytes>> batch;
  while (const auto message = blocks_->receive()) {
    net::dispatch<wire::ChunkList, wire::Chunk>(*blocks_, *message, [&](const auto& m) {
      if (m.epoch != epoch_) return;
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::ChunkList>) {
        if (!cache_.known()) cache_.reset(m.chunks);
        progress_s_ = now_s;
      } else if (cache_.waiting(m.chunk)) {
        retry_.answered(cache_.bytes_of(m.chunk), m.data.size(), monotonic_s());
        if (m.data.empty()) return refuse(m.chunk, "there is no such chunk");
        batch.emplace_back(m.chunk, geometry::ChunkBytes{m.data, message->owner});
        progress_s_ = now_s;
      }
    });
    if (batch.size() >= kChunksInFlight) break;
  }
  builder_.take(std::move(batch));
  for (const ChunkBuilder::Added& chunk : builder_.add()) {
    spans_.add("add chunk", link_.to_master_s(chunk.begin_s), link_.to_master_s(chunk.end_s));
    if (!chunk.status)
      refuse(chunk.id, chunk.status.error().text);
    else
      for (const ChunkId old : cache_.insert(chunk.id, chunk.bytes)) builder_.sampler().remove_chunk(old);
  }
}

void MeshTiles::refuse(ChunkId id, const std::string& why) {
  ++chunks_refused_;
  if (cache_.refuse(id))
    log::warn("chunk {} of {} was refused {} times: {}; views do without it", id.value, endpoint_, ChunkCache::kTries,
              why);
}

void MeshTiles::add_status(net::MasterLink::Values& values) const {
  values["chunk_mb"] = double(cache_.bytes()) / 1e6;
  values["chunks_refused"] = double(chunks_refused_);
  values["tiles_coarse"] = double(patience_.coarse());
  values["chunks_lacking"] = double(cache_.holes());
  values["messages_rejected"] = blocks_ ? double(blocks_->rejected()) : 0.0;
}

// ---- the cache of chunks -------------------------------------------------------------------------------------------

void ChunkCache::reset(std::vector<geometry::ChunkInfo> chunks) {
  chunks_ = std::move(chunks);
  held_.clear();
  refused_.clear();
  waiting_.clear();
  bytes_ = 0;
  holes_ = 0;
}

Cut ChunkCache::cut(const geometry::Camera& camera, const geometry::Rect& part) {
  if (!(std::exchange(used_by_, camera) == camera)) ++use_;
  return choose_cut(chunks_, camera, geometry::Frustum(geometry::crop(camera, part)), [this](ChunkId id) {
    const auto found = held_.find(id);
    if (found == held_.end()) return false;
    found->second.use = use_;
    return true;
  });
}

std::vector<ChunkId> ChunkCache::prefetch(bool at_rest) const {
  std::vector<ChunkId> out;
  uint64_t bytes = bytes_;
  for (auto c = chunks_.rbegin(); c != chunks_.rend(); ++c) {
    if (held_.contains(c->id)) continue;
    if (!at_rest && (c->is_leaf() || chunks_[c->first_child].is_leaf())) break;
    bytes += memory(kBytesPerTriangle * c->triangles, c->triangles);
    if (bytes > budget_bytes_) break;
    out.push_back(c->id);
  }
  return out;
}

uint64_t ChunkCache::bytes_of(ChunkId id) const { return id.value < chunks_.size() ? chunks_[id.value].bytes : 0; }

uint64_t ChunkCache::waiting_bytes() const {
  uint64_t out = 0;
  for (const ChunkId id : waiting_) out += bytes_of(id);
  return out;
}

std::vector<ChunkId> ChunkCache::insert(ChunkId id, uint64_t bytes) {
  waiting_.erase(id);
  refused_.erase(id);
  const uint64_t held = memory(bytes, id.value < chunks_.size() ? chunks_[id.value].triangles : 0);
  if (held_.try_emplace(id, Held{use_, held}).second) bytes_ += held;
  std::vector<ChunkId> removed;
  while (bytes_ > budget_bytes_) {
    const auto oldest = std::min_element(held_.begin(), held_.end(),
                                         [](const auto& a, const auto& b) { return a.second.use < b.second.use; });
    if (oldest->second.use == use_) break;
    removed.push_back(oldest->first);
    bytes_ -= oldest->second.bytes;
    held_.erase(oldest);
  }
  return removed;
}

bool ChunkCache::refuse(ChunkId id) {
  waiting_.erase(id);
  if (++refused_[id] < kTries) return false;
  refused_.erase(id);
  holes_ += held_.try_emplace(id, Held{use_, 0}).second;
  return true;
}

}  // namespace telesplat::sampler
