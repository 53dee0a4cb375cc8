// Counts the bytes that wait to be sent to each peer: ZeroMQ's own limits count messages, which may have a byte or
// hundreds of megabytes. No sockets.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>

namespace telesplat::net {

class QueuedBytes {
 public:
  using Count = std::shared_ptr<std::atomic<uint64_t>>;
  /// A message on its way: its bytes count until the ticket is destroyed, in any thread.
  class Ticket {
   public:
    Ticket() = default;
    Ticket(Count count, Count of_all, uint64_t bytes)
        : count_(std::move(count)), of_all_(std::move(of_all)), bytes_(bytes) {
      *count_ += bytes_, *of_all_ += bytes_;
    }
    ~Ticket() {
      if (count_) *count_ -= bytes_, *of_all_ -= bytes_;
    }
    Ticket(Ticket&& other) noexcept
        : count_(std::move(other.count_)), of_all_(std::move(other.of_all_)), bytes_(other.bytes_) {}
    Ticket& operator=(Ticket&&) = delete;

   private:
    Count count_, of_all_;
    uint64_t bytes_ = 0;
  };

  /// most: bytes for one peer. Above twice that for all together, the waiting peers share an eighth of it.
  explicit QueuedBytes(uint64_t most) : most_(most) {}

  /// True if one more message fits for this peer. A peer without queued bytes may have one of any size.
  bool has_room(std::string_view peer, uint64_t bytes) {
    const auto found = peers_.find(std::string(peer));
    return found == peers_.end() || fits(*found->second, bytes);
  }
  Ticket add(std::string_view peer, uint64_t bytes) {
    if (peers_.size() >= most_peers_) forget_idle();
    Count& count = peers_[std::string(peer)];
    if (!count) count = std::make_shared<std::atomic<uint64_t>>(0);
    return {count, of_all_, bytes};
  }
  uint64_t of(std::string_view peer) const {
    const auto found = peers_.find(std::string(peer));
    return found == peers_.end() ? 0 : found->second->load();
  }
  uint64_t of_all() const { return *of_all_; }
  uint64_t most() const { return most_; }

 private:
  static constexpr uint64_t kReserve = 8;  // the waiting peers share most_ / kReserve when the total is high

  bool fits(uint64_t queued, uint64_t bytes) const {
    if (queued == 0) return true;
    if (queued + bytes > most_) return false;
    if (*of_all_ + bytes <= 2 * most_) return true;
    const auto wait = std::count_if(peers_.begin(), peers_.end(), [](const auto& p) { return *p.second > 0; });
    return queued + bytes <= most_ / kReserve / uint64_t(std::max<std::ptrdiff_t>(1, wait));
  }
  void forget_idle() {
    std::erase_if(peers_, [](const auto& p) { return *p.second == 0; });
    most_peers_ = 2 * peers_.size() + 256;
  }

  const uint64_t most_;
  size_t most_peers_ = 256;                       // above it, peers without queued bytes are forgotten
  std::unordered_map<std::string, Count> peers_;  // by routing id
  const Count of_all_ = std::make_shared<std::atomic<uint64_t>>(0);
};

}  // namespace telesplat::net
