#include "services/packer/points/base/base_fetch.h"

#include <algorithm>
#include <utility>

#include "common/core/log.h"
#include "common/geometry/chunk_code.h"
#include "common/net/dispatch.h"

namespace telesplat::packer {
namespace {

// Time until a request is repeated: the store is being made, or the answer is on its way.
constexpr double kLeastPatience_s = 0.25, kMostPatience_s = 16;

}  // namespace

void BaseFetch::connect(const std::string& endpoint) {
  if (endpoint == endpoint_) return;
  endpoint_ = endpoint;
  blocks_.emplace(*context_, net::Kind::kDealer, "packer:chunks",
                  net::SocketOptions{.max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                                     .patience_s = net::kBulkPatience_s,
                                     .watch_connecting = true,
                                     .toward = "data"});
  asked_s_ = -1e9;
  if (const Status s = blocks_->connect(endpoint_); !s) log::error("{}", s.error().text);
}

void BaseFetch::begin(Wanted wanted, const scene::ColourTable* colours) {
  stop();
  wanted_ = std::move(wanted);
  colours_ = colours;
  asks_ = true;
  asked_s_ = -1e9, patience_s_ = kLeastPatience_s;
}

void BaseFetch::stop() {
  asks_ = false;
  made_.reset();
}

std::vector<net::Socket*> BaseFetch::sockets() {
  return blocks_ ? std::vector<net::Socket*>{&*blocks_} : std::vector<net::Socket*>{};
}

std::optional<Base> BaseFetch::receive() {
  if (!blocks_) return {};
  while (const auto message = blocks_->receive())
    net::dispatch<wire::ChunkList, wire::Chunk>(*blocks_, *message, [&](const auto& m) {
      if (asks_ && m.epoch == wanted_.epoch) take(m);
    });
  return asks_ ? std::nullopt : std::exchange(made_, std::nullopt);
}

void BaseFetch::take(const wire::ChunkList& list) {
  if (made_) return;
  auto chunks = choose_base(list.chunks, wanted_.most);
  if (chunks.fine.empty()) return give_up("the mesh has no triangles");
  made_.emplace(wanted_.largest_m, colours_);
  coarse_ = chunks.coarse.size();
  spacings_m_.clear();
  for (const auto& chunk : list.chunks) spacings_m_.push_back(chunk.spacing_m);
  next_ = std::move(chunks.fine);
  next_.insert(next_.end(), chunks.coarse.begin(), chunks.coarse.end());
  ask();
}

void BaseFetch::take(const wire::Chunk& m) {
  if (!made_ || m.chunk != next_.back()) return;
  const auto chunk = geometry::decode_chunk(m.data);
  if (!chunk) return give_up(chunk.error().text);
  if (chunk->view.scalars != (colours_ != nullptr))
    return give_up(std::string("the data server's chunks hold ") + (colours_ ? "colours" : "scalars"));
  made_->add(chunk->view, spacings_m_[m.chunk.value], coarse_ > 0);
  coarse_ -= coarse_ > 0;
  next_.pop_back();
  if (!next_.empty()) return ask();
  if (made_->parts() > wire::kMaxBaseParts) return give_up("it has too many parts");
  asks_ = false;
}

void BaseFetch::give_up(const std::string& why) {
  log::warn("viewers have no base: {}", why);
  stop();
}

void BaseFetch::ask() {
  if (made_)
    blocks_->send(wire::ChunkRequest{wanted_.epoch, next_.back(), wanted_.array});
  else
    blocks_->send(wire::ChunkListRequest{wanted_.epoch, wanted_.array});
  patience_s_ = kLeastPatience_s;
}

void BaseFetch::tick(double now_s) {
  if (!asks_ || !blocks_ || now_s - asked_s_ < patience_s_) return;
  const double patience_s = asked_s_ > 0 ? std::min(2 * patience_s_, kMostPatience_s) : patience_s_;
  asked_s_ = now_s;
  ask();
  patience_s_ = patience_s;
}

}  // namespace telesplat::packer
