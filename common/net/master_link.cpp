#include "common/net/master_link.h"

#include <unistd.h>

#include "common/core/clock.h"
#include "common/core/utf8.h"
#include "common/net/process_facts.h"

namespace telesplat::net {
namespace {
constexpr double kHelloPeriod_s = 0.25, kStatusPeriod_s = 1.0;
}

MasterLink::MasterLink(Context& context, const std::string& endpoint, wire::Hello hello)
    : hello_(std::move(hello)),
      socket_(context, Kind::kDealer, hello_.name + ":master", {.max_message_bytes = wire::kMaxBulkBytes}) {
  if (hello_.instance.value == 0) hello_.instance = make_instance_id();
  hello_.facts.merge(process_facts());
  // Names and paths of this machine may be any bytes; messages hold UTF-8.
  hello_.name = to_utf8(hello_.name);
  for (auto& [fact, value] : hello_.facts) value = to_utf8(value);
  hello_.pid = static_cast<uint64_t>(getpid());
  if (const Status s = socket_.connect(endpoint); !s) log::error("{}", s.error().text);
}

void MasterLink::report(const std::function<Values()>& status) {
  wire::StatusReport report{hello_.instance, status()};
  report.values["messages_rejected"] += static_cast<double>(socket_.rejected());
  report.values["reported_s"] = monotonic_s();
  socket_.send(report);
}

void MasterLink::tick(double now_s, const std::function<Values()>& status) {
  if (!welcomed_ && now_s - last_hello_s_ >= kHelloPeriod_s) {
    hello_.sent_s = now_s;
    socket_.send(hello_);
    last_hello_s_ = now_s;
  }
  if (welcomed_ && now_s - last_status_s_ >= kStatusPeriod_s) {
    report(status);
    last_status_s_ = now_s;
  }
}

bool MasterLink::handle(const Message& message, double now_s) {
  if (message.type == wire::Welcome::kName) {
    if (auto welcome = socket_.decode<wire::Welcome>(message)) {
      // Offset from the exchange with the shortest round trip (as NTP does).
      if (welcome->hello_sent_s != 0) {
        const double round_trip_s = now_s - welcome->hello_sent_s;
        if (!session_ || session_->master != welcome->master) best_round_trip_s_ = 1e9;
        if (round_trip_s >= 0 && round_trip_s < best_round_trip_s_) {
          best_round_trip_s_ = round_trip_s;
          offset_s_ = welcome->master_s - (now_s + welcome->hello_sent_s) / 2;
          if (std::abs(offset_s_) < round_trip_s) offset_s_ = 0;  // one machine, one clock: do not add noise
        }
      }
      session_ = std::move(welcome);
      welcomed_ = true;
      ++version_;
    }
    return true;
  }
  if (message.type == wire::WhoAreYou::kName) {
    if (welcomed_) log::info("the master asks who we are: saying hello again");
    welcomed_ = false;
    return true;
  }
  if (message.type == wire::Shutdown::kName) {
    if (const auto shutdown = socket_.decode<wire::Shutdown>(message)) {
      log::debug("shutdown: {}", shutdown->reason);
      shutdown_ = true;
    }
    return true;
  }
  return false;
}

void MasterLink::receive(double now_s) {
  while (const auto message = socket_.receive())
    if (!handle(*message, now_s)) socket_.reject(*message, "its type is not expected here");
}

void MasterLink::tell(const std::string& fact, const std::string& value) {
  hello_.facts[fact] = to_utf8(value);
  if (!welcomed_) return;  // the hello that is due anyway tells it
  hello_.sent_s = 0;       // no exchange to take the time from
  socket_.send(hello_);
}

void MasterLink::leave(const std::function<Values()>& status) {
  report(status);
  socket_.send(wire::Goodbye{hello_.instance});
}

}  // namespace telesplat::net
