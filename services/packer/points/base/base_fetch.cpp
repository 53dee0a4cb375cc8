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

void BaseFetch::begin(Wanted wanted) {
  stop();
  wanted_ = std::move(wanted);
  wants_list_ = true;
  asked_s_ = -1e9, patience_s_ = kLeastPatience_s;
}

void BaseFetch::want(ChunkId chunk) {
  if (std::ranges::find(next_, chunk) != next_.end()) return;
  next_.push_back(chunk);
  if (next_.size() == 1) ask();
}

void BaseFetch::stop() {
  wants_list_ = false;
  next_.clear();
}

std::vector<net::Socket*> BaseFetch::sockets() {
  return blocks_ ? std::vector<net::Socket*>{&*blocks_} : std::vector<net::Socket*>{};
}

void BaseFetch::receive(const Sinks& sinks) {
  if (!blocks_) return;
  while (const auto message = blocks_->receive())
    net::dispatch<wire::ChunkList, wire::Chunk>(*blocks_, *message, [&](auto& m) {
      if (m.epoch != wanted_.epoch) return;
      if constexpr (std::is_same_v<std::decay_t<decltype(m)>, wire::ChunkList>) {
        if (std::exchange(wants_list_, false)) sinks.list(std::move(m.chunks));
      } else if (!next_.empty() && m.chunk == next_.front()) {
        next_.pop_front();
        if (!next_.empty()) ask();
        sinks.chunk(m.chunk, geometry::decode_chunk(m.data));
      }
    });
}

void BaseFetch::ask() {
  if (!blocks_) return;
  if (wants_list_)
    blocks_->send(wire::ChunkListRequest{wanted_.epoch, wanted_.array});
  else
    blocks_->send(wire::ChunkRequest{wanted_.epoch, next_.front(), wanted_.array});
  patience_s_ = kLeastPatience_s;
  fresh_ = true;
}

void BaseFetch::tick(double now_s) {
  if (std::exchange(fresh_, false)) asked_s_ = now_s;
  if (!asks() || !blocks_ || now_s - asked_s_ < patience_s_) return;
  const double patience_s = asked_s_ > 0 ? std::min(2 * patience_s_, kMostPatience_s) : patience_s_;
  asked_s_ = now_s;
  ask();
  patience_s_ = patience_s, fresh_ = false;
}

}  // namespace telesplat::packer
