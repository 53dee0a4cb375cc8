#include "common/net/master_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <utility>

#include "common/core/clock.h"
#include "common/core/machine.h"
#include "common/core/utf8.h"
#include "common/net/service.h"
#include "common/scene/session.h"

namespace telesplat::net {

namespace {
constexpr double kHelloPeriod_s = 0.25, kStatusPeriod_s = 1.0;
constexpr double kSilence_s = 5;       // a master answers once a second
constexpr double kSignPeriod_s = 1.5;  // period of signs of life while no reports come
}  // namespace

struct MasterLink::Life {
  std::atomic<bool> welcomed{false};
  std::atomic<InstanceId> self;
  std::atomic<double> ticked_s{0}, said_s{0};  // times of the owner's last tick, and of the last report or sign
};

MasterLink::MasterLink(Context& context, const std::string& endpoint, wire::Hello hello, double give_up_after_s)
    : hello_(std::move(hello)),
      life_(std::make_shared<Life>()),
      socket_(context, Kind::kDealer, hello_.name + ":master",
              {.max_message_bytes = wire::kMaxControlBytes, .watch_connecting = true, .read_ahead = true}),
      endpoint_(endpoint),
      waiting_(give_up_after_s),
      host_(endpoint) {
  if (hello_.instance.value == 0) hello_.instance = make_instance_id();
  hello_.facts.merge(process_facts());
  // Names and paths of this machine may be any bytes; messages hold UTF-8.
  hello_.name = to_utf8(hello_.name);
  for (auto& [fact, value] : hello_.facts) value = to_utf8(value);
  hello_.pid = process_id();
  life_->self = hello_.instance;
  if (const Status s = socket_.connect(endpoint); !s) log::error("{}", s.error().text);
  socket_.set_due([life = life_]() -> std::optional<std::pair<std::string, std::string>> {
    const double now_s = monotonic_s();
    if (!life->welcomed || now_s - life->said_s < kSignPeriod_s || now_s - life->ticked_s > kLongestWork_s)
      return std::nullopt;
    life->said_s = now_s;
    return std::pair(std::string(wire::StatusReport::kName), wire::encode(wire::StatusReport{life->self, {}}));
  });
}

void MasterLink::follow_welcomed(bool welcomed) {
  welcomed_ = welcomed;
  life_->said_s = monotonic_s();
  life_->welcomed = welcomed;
  if (welcomed) renewals_.welcomed();
}

void MasterLink::say_hello(double sent_s) {
  hello_.sent_s = sent_s;
  socket_.send(hello_);
  renewals_.said_hello();
}

bool MasterLink::renew() {
  if (!renewed_) return false;
  if (const auto answer = renewals_.refused(); answer != Renewals::Answer::kRenew)
    return answer == Renewals::Answer::kToInstanceBefore;
  life_->self = hello_.instance = make_instance_id();
  log::warn("the master knows {} as a process of another key: it joins again as a new one", hello_.name);
  follow_welcomed(false);
  renewed_(hello_.instance);
  return true;
}

void MasterLink::report(const std::function<Values()>& status, double now_s) {
  wire::StatusReport report{hello_.instance, status()};
  report.values["messages_rejected"] += static_cast<double>(socket_.rejected());
  report.values["reported_s"] = now_s;
  if (clock_.known()) {
    report.values["clock_offset_ms"] = clock_.offset_s(now_s) * 1e3;
    report.values["clock_error_ms"] = clock_.error_s(now_s) * 1e3;
    report.values["clock_drift_ppm"] = clock_.drift() * 1e6;
    report.values["master_round_trip_ms"] = clock_.round_trip_s() * 1e3;
  }
  socket_.send(report);
  life_->said_s = monotonic_s();
}

void MasterLink::tick(double now_s, const std::function<Values()>& status) {
  life_->ticked_s = monotonic_s();
  if (!welcomed_ && now_s - last_hello_s_ >= kHelloPeriod_s) {
    say_hello(monotonic_s());
    last_hello_s_ = now_s;
  }
  if (welcomed_ && now_s - last_status_s_ >= kStatusPeriod_s) {
    report(status, now_s);
    last_status_s_ = now_s;
  }
  if (welcomed_ && clock_polls_.ask(now_s)) socket_.send(wire::ClockRequest{monotonic_s()});
  look_for_refusal();
  look_at_waiting(now_s);
}

// Describes what this process waits for and cannot go on without; empty: nothing.
std::string MasterLink::awaited() {
  if (end_.over || warned_) return {};
  if (welcomed_ && silent_s_ < kSilence_s)
    return session_ ? lacking_text(scene::value_or(session_->facts, "lacks", std::string())) : std::string();
  const char* const before = session_ ? "the master of the session is gone: " : "";
  if (socket_.in_touch())
    return fmt::format(
        "{}what takes connections at {} does not answer: it is no master, is busy, or speaks another version of the "
        "protocol than {}",
        before, endpoint_, wire::kProtocolVersion);
  if (!socket_.tunnelled()) host_.begin();
  const std::string problem = host_.problem();
  return problem.empty() ? fmt::format("{}no master is at {}", before, endpoint_)
                         : fmt::format("{}no master is at {}: {}", before, endpoint_, problem);
}

// Counts how long the master is silent. Time in which the owner worked and read nothing does not count.
void MasterLink::look_at_waiting(double now_s) {
  constexpr double kLongestTurn_s = 0.5;
  silent_s_ += std::clamp(now_s - std::exchange(ticked_s_, now_s), 0.0, kLongestTurn_s);
  if (const auto line = waiting_.look(awaited(), now_s)) log::warn("{}", *line);
  if (end_.over || !waiting_.gives_up(now_s)) return;
  log::error("{}; gives up after {} s (--give-up-after)", awaited(), waiting_.most_s());
  end_.gave_up = end_.over = true;
}

// A handshake that breaks off is no refusal: it may be a tunnel whose other end is not there yet.
void MasterLink::look_for_refusal() {
  if (end_.refused) return;
  const auto refusal = socket_.refusal();
  if (refusal.text.empty()) {
    warned_ = false;
  } else if (!refusal.may_pass) {
    log::error("the master at {} refuses {}: {}", endpoint_, hello_.name, refusal.text);
    end_.refused = end_.over = true;
  } else if (!warned_) {
    log::warn("the master at {} does not let {} in: {}; trying on", endpoint_, hello_.name, refusal.text);
    warned_ = true;
  }
}

void MasterLink::learn_clock(const wire::ClockReply& reply, double arrived_s) {
  if (!session_ || reply.master != session_->master) return;
  if (!reply.clock.empty() && reply.clock == clock_id()) clock_.same_clock();
  clock_.add({reply.sent_s, reply.received_s, reply.replied_s, arrived_s});
}

bool MasterLink::handle(const Message& message) {
  silent_s_ = 0;
  if (message.type == wire::Welcome::kName) {
    if (auto welcome = socket_.decode<wire::Welcome>(message)) {
      const bool another = !session_ || session_->master != welcome->master;
      if (another) clock_.clear(), clock_polls_.begin_anew();
      session_ = std::move(welcome);
      if (!welcomed_) follow_welcomed(true);
      ++version_;
      // The hello and the welcome are an exchange of clocks, too.
      if (another && session_->hello_sent_s != 0)
        learn_clock({session_->master, session_->hello_sent_s, session_->master_s, session_->master_s, session_->clock},
                    message.arrived_s);
    }
    return true;
  }
  if (message.type == wire::ClockReply::kName) {
    if (const auto reply = socket_.decode<wire::ClockReply>(message)) learn_clock(*reply, message.arrived_s);
    return true;
  }
  if (message.type == wire::WhoAreYou::kName) {
    if (welcomed_) log::info("the master asks who we are: saying hello again");
    follow_welcomed(false);
    return true;
  }
  if (message.type == wire::Shutdown::kName) {
    if (const auto shutdown = socket_.decode<wire::Shutdown>(message)) {
      if (shutdown->reason.starts_with(wire::kInstanceTaken) && renew()) return true;
      end_ = {.over = true,
              .refused = !welcomed_ && !session_,
              .gave_up = end_.gave_up,
              .reason = printable(shutdown->reason)};
      if (end_.refused)
        log::error("the master at {} refuses {}: {}", endpoint_, hello_.name, end_.reason);
      else
        log::info("{}", end_.reason);
    }
    return true;
  }
  if (message.type == wire::Order::kName) {
    const auto order = socket_.decode<wire::Order>(message);
    if (order && obey_)
      obey_(*order);
    else if (order)
      answer(order->number, false, hello_.role + " " + hello_.name + " takes no orders");
    return true;
  }
  return false;
}

void MasterLink::answer(uint64_t number, bool ok, std::string text) {
  socket_.send(wire::OrderAnswer{hello_.instance, number, ok, to_utf8(text)});
}

void MasterLink::receive() {
  while (const auto message = socket_.receive())
    if (!handle(*message)) socket_.reject(*message, "its type is not expected here");
}

void MasterLink::tell(const std::string& fact, const std::string& value) {
  wire::Hello changed = hello_;
  changed.facts[fact] = value;
  tell(changed);
}

void MasterLink::tell(const wire::Hello& changed) {
  for (const auto& [fact, value] : changed.facts) hello_.facts[fact] = to_utf8(value);
  hello_.parameters = changed.parameters, hello_.box_room = changed.box_room;
  if (!welcomed_) return;  // the hello that is due anyway contains it
  say_hello(0);            // 0: not for an exchange of clocks
}

void MasterLink::leave(const std::function<Values()>& status) {
  report(status, monotonic_s());
  life_->welcomed = false;  // sends nothing after the goodbye
  socket_.send(wire::Goodbye{hello_.instance});
}

namespace {

constexpr size_t kMostExchanges = 512;
constexpr size_t kLeastForDrift = 8;
constexpr double kMostDrift = 500e-6;    // largest drift that an operating system corrects
constexpr double kLeastError_s = 20e-6;  // error of reading clocks and waking up
constexpr double kSigmas = 3;            // width of the slope's error bounds

}  // namespace

void ClockEstimate::clear() { *this = {}; }

void ClockEstimate::add(const ClockExchange& e) {
  const Seen seen{(e.sent_s + e.arrived_s) / 2, e.offset_s(), e.round_trip_s()};
  if (!std::isfinite(seen.offset_s) || !std::isfinite(seen.at_s) || !(seen.round_trip_s >= 0) ||
      e.replied_s < e.received_s)
    return;
  if (!exchanges_.empty() && seen.at_s < exchanges_.back().at_s) return;  // an answer that a later one overtook
  exchanges_.push_back(seen);
  while (exchanges_.size() > kMostExchanges || exchanges_.front().at_s < seen.at_s - kMemory_s) exchanges_.pop_front();
  estimate_drift();
}

// Fits a line through the offsets by least squares, weighted by half the round trip, the largest error of an offset.
void ClockEstimate::estimate_drift() {
  drift_ = 0, drift_error_ = kUnknownDrift;
  if (exchanges_.size() < kLeastForDrift || exchanges_.back().at_s - exchanges_.front().at_s < kDriftAfter_s) return;
  const auto weight = [](const Seen& s) { return 1 / std::pow(std::max(s.round_trip_s / 2, kLeastError_s), 2); };
  double weights = 0, t = 0, o = 0, tt = 0, to = 0;
  for (const Seen& s : exchanges_) {
    const double w = weight(s);
    weights += w, t += w * s.at_s, o += w * s.offset_s;
  }
  t /= weights, o /= weights;
  for (const Seen& s : exchanges_) {
    const double w = weight(s);
    tt += w * (s.at_s - t) * (s.at_s - t), to += w * (s.at_s - t) * (s.offset_s - o);
  }
  const double error = kWander + kSigmas / std::sqrt(tt);
  if (!(error < kUnknownDrift)) return;
  drift_ = std::clamp(to / tt, -kMostDrift, kMostDrift);
  drift_error_ = error;
}

double ClockEstimate::error_s(const Seen& seen, double local_s) const {
  return std::max(seen.round_trip_s / 2, kLeastError_s) + drift_error_ * std::abs(local_s - seen.at_s);
}

const ClockEstimate::Seen& ClockEstimate::best(double local_s) const {
  return *std::min_element(exchanges_.begin(), exchanges_.end(),
                           [&](const Seen& a, const Seen& b) { return error_s(a, local_s) < error_s(b, local_s); });
}

double ClockEstimate::offset_s(double local_s) const {
  if (same_ || !known()) return 0;
  const Seen& seen = best(local_s);
  return seen.offset_s + drift_ * (local_s - seen.at_s);
}

double ClockEstimate::error_s(double local_s) const {
  if (same_) return 0;
  return known() ? error_s(best(local_s), local_s) : std::numeric_limits<double>::infinity();
}

double ClockEstimate::round_trip_s() const {
  double out = !exchanges_.empty() ? exchanges_.front().round_trip_s : 0;
  for (const Seen& s : exchanges_) out = std::min(out, s.round_trip_s);
  return out;
}

}  // namespace telesplat::net
