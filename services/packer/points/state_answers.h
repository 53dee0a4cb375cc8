// Brings viewers up to date in pieces: missing events go out as fast as the viewer's receipts come, so that a joining
// viewer takes neither memory nor the packer's time from others. No sockets, no clocks.
#pragma once

#include <algorithm>
#include <cstdint>
#include <deque>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "common/wire/point_messages.h"
#include "services/packer/points/event_log.h"

namespace telesplat::packer {

/// Answers to state requests, one per connection.
class StateAnswers {
 public:
  struct Limits {
    uint64_t window_bytes = 8u << 20;   ///< sent to a viewer and not yet received, about
    uint64_t bytes_in_all = 64u << 20;  ///< in all: shared among payers, then connections
    uint64_t bytes_at_once = 1u << 20;  ///< to all viewers, in one turn
    size_t viewers = 256;               ///< beyond, the answer begun first is dropped: its viewer asks again
  };
  struct Answer {
    InstanceId viewer;
    std::string payer;  ///< net::payer() of the viewer
    EventLog::Replay left;
    wire::StateMark mark;  ///< sent at the end
    uint64_t events = 0;   ///< number of events sent
  };

  StateAnswers() = default;
  explicit StateAnswers(const Limits& limits) : limits_(limits) {}

  /// A viewer asks over this connection for the events after `after`. follows: it has the events sent so far, up to its
  /// last receipt; false: it begins anew. True: it is being answered already; missing events are under way or follow.
  bool goes_on(const std::string& peer, InstanceId viewer, Sequence after, bool follows) {
    for (auto& [other, entry] : answers_)
      if (entry.answer.viewer == viewer && other != peer) entry.stop();
    Entry* const found = find(peer);
    if (!found) return false;
    if (follows && found->answer.viewer == viewer && after >= found->received) {
      received(peer, after);
      return find(peer) != nullptr;
    }
    found->stop();
    return false;
  }
  /// True if the connection's queue has reached its limit: another answer to it is not begun.
  bool is_full(const std::string& peer) const {
    const auto found = answers_.find(peer);
    return found != answers_.end() && found->second.waiting > 0 && found->second.waiting >= found->second.window;
  }
  void begin(const std::string& peer, Sequence after, Answer answer) {
    if (size() >= limits_.viewers)
      std::ranges::min_element(answers_, {}, [](const auto& a) {
        return std::pair(a.second.stopped, a.second.number);
      })->second.stop();
    Entry& entry = answers_[peer];
    entry = {.answer = std::move(answer), .received = after, .number = ++begun_, .waiting = entry.waiting};
  }
  /// The viewer at this connection has applied all events up to `newest`.
  void received(const std::string& peer, Sequence newest) {
    Entry* const a = find(peer);
    if (!a) return;
    a->received = std::max(a->received, newest);
    for (; !a->under_way.empty() && a->under_way.front().first <= newest; a->under_way.pop_front())
      a->bytes -= a->under_way.front().second;
    if (a->all_sent && a->under_way.empty()) a->stop();
  }
  /// Drops the rest of the answer to this connection.
  void drop(const std::string& peer) {
    if (Entry* const a = find(peer)) a->stop();
  }
  void clear() {
    for (auto& [peer, a] : answers_) a.stop();
  }

  /// Sends some of the remaining events, connection by connection. next(Replay&): its next event, or nullopt.
  /// send(peer, Event), and end(peer, Answer) after the last event: false if sending failed; that viewer asks again.
  /// bytes_of(Event): its size on the wire. waiting(peer): bytes in its queue, also from stopped answers.
  template <class Next, class Send, class End, class BytesOf, class Waiting>
  void pump(const Next& next, const Send& send, const End& end, const BytesOf& bytes_of, const Waiting& waiting) {
    share_out(waiting);
    for (uint64_t sent = 0; sent < limits_.bytes_at_once;) {
      const auto turn = next_turn();
      if (turn == answers_.end()) return;
      turn_ = turn->first;
      Entry& a = turn->second;
      const auto event = next(a.answer.left);
      bool there = false;
      if (event) {
        const uint64_t bytes = bytes_of(*event) + kMessageBytes;
        a.under_way.emplace_back(event->sequence, bytes);
        a.bytes += bytes, a.waiting += bytes, sent += bytes, ++a.answer.events;
        there = send(turn->first, *event);
      } else {
        a.all_sent = true;
        sent += kMessageBytes;
        there = end(turn->first, a.answer);
      }
      if (!there || (a.all_sent && a.under_way.empty())) a.stop();
    }
  }
  /// True if pump() would send an event.
  bool can_go_on() const {
    return std::any_of(answers_.begin(), answers_.end(), [this](const auto& a) { return may_send(a.second); });
  }

  size_t size() const {
    return size_t(std::ranges::count_if(answers_, [](const auto& a) { return !a.second.stopped; }));
  }
  /// Sum over all viewers.
  uint64_t bytes_under_way() const {
    uint64_t out = 0;
    for (const auto& [peer, a] : answers_) out += a.held();
    return out;
  }

 private:
  // Memory that a message takes in queues beside its bytes.
  static constexpr uint64_t kMessageBytes = 2048;
  struct Entry {
    Answer answer;
    Sequence received;  // newest event that the viewer is known to have
    std::deque<std::pair<Sequence, uint64_t>> under_way{};
    uint64_t bytes = 0;  // sum over `under_way`
    bool all_sent = false;
    uint64_t number = 0;   // order of beginning
    uint64_t waiting = 0;  // bytes in the connection's queue at the last pump(), independent of receipts
    uint64_t window = 0;   // limit for held(), set by the last pump()
    bool stopped = false;  // nothing is left of the answer but queued bytes

    uint64_t held() const { return std::max(bytes, waiting); }
    void stop() {
      answer.viewer = {}, answer.left = {}, under_way.clear();
      bytes = 0, stopped = true;
    }
  };
  Entry* find(const std::string& peer) {
    const auto found = answers_.find(peer);
    return found == answers_.end() || found->second.stopped ? nullptr : &found->second;
  }
  // Divides the window, so that a payer with many connections, or queues that are not read, leave others their shares.
  template <class Waiting>
  void share_out(const Waiting& waiting) {
    std::map<std::string_view, uint64_t> connections;  // by payer
    for (auto at = answers_.begin(); at != answers_.end();) {
      Entry& a = at->second;
      a.waiting = waiting(at->first);
      if (a.stopped && a.waiting == 0) {
        at = answers_.erase(at);
        continue;
      }
      ++connections[a.answer.payer], ++at;
    }
    for (auto& [peer, a] : answers_)
      a.window =
          std::min(limits_.window_bytes, limits_.bytes_in_all / connections.size() / connections[a.answer.payer]);
  }
  bool may_send(const Entry& a) const { return !a.stopped && !a.all_sent && a.held() < a.window; }
  // Returns the next connection after the one that was served last.
  std::map<std::string, Entry>::iterator next_turn() {
    auto at = answers_.upper_bound(turn_);
    for (size_t n = 0; n < answers_.size(); ++n, ++at) {
      if (at == answers_.end()) at = answers_.begin();
      if (may_send(at->second)) return at;
    }
    return answers_.end();
  }

  Limits limits_;
  std::map<std::string, Entry> answers_;  // by connection
  std::string turn_;
  uint64_t begun_ = 0;
};

}  // namespace telesplat::packer
