#include "services/data/data_service.h"

#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <optional>

#include "common/core/clock.h"
#include "common/core/utf8.h"
#include "common/metrics/process.h"
#include "common/net/connections/peer_rates.h"
#include "common/net/master_link.h"
#include "services/data/base/cut_off.h"
#include "services/data/kinds.h"
#include "services/data/record.h"

namespace telesplat::data {
namespace {

// Longest wait of the loop for messages. While a background task runs, its end does not end the wait: kBusy_s.
constexpr double kQuiet_s = 0.05, kBusy_s = 0.002;
constexpr size_t kMostRemarks = 4000;  // bytes of notes in the hello
constexpr int kRequestsATurn = 64;     // then the master's messages get their turn

// Reports progress to the launcher's pipe, or to the log every two seconds. scene: the file.
Progress make_progress(bool to_stdout, const std::string& scene) {
  const std::string name = to_utf8(std::filesystem::path(scene).filename().string());
  return [to_stdout, name, last_s = monotonic_s()](const char* stage, double fraction) mutable {
    const double now = monotonic_s();
    const bool of_the_file = stage == std::string_view(kReading) || stage == std::string_view(kIdentifying);
    const std::string what = of_the_file && !name.empty() ? fmt::format("{} {}", stage, name) : stage;
    if (to_stdout) {
      std::fputs(fmt::format("progress {} {:.3f}\n", what, fraction).c_str(), stdout);
      std::fflush(stdout);
    } else if (now - last_s >= 2.0) {
      log::info("{}: {:.0f} %", what, fraction * 100);
      last_s = now;
    }
  };
}

// Where requests come in. Without a socket there is nothing to ask for.
struct RequestDoor {
  std::optional<net::Socket> socket;
  std::string endpoint;
};

Result<RequestDoor> bind_requests(net::Context& context, const Served::Requests& requests,
                                  const net::ServiceOptions& o) {
  RequestDoor out;
  if (requests.endpoint.empty()) return out;
  out.socket.emplace(context, net::Kind::kRouter, o.name + ":" + std::string(requests.endpoint),
                     net::SocketOptions{.high_water_mark = requests.high_water_mark,
                                        .patience_s = net::kBulkPatience_s,
                                        .serves = requests.endpoint,
                                        .most_connections = o.max_connections,
                                        .most_queued_bytes = o.queue_limit_bytes()});
  const auto bound = out.socket->bind(o.bind, o.insecure);
  if (!bound) return bound.error();
  out.endpoint = net::announced(*bound, o.advertise);
  return out;
}

net::MasterLink::Values status_of(const Served& served, const std::optional<net::Socket>& requests,
                                  const net::PeerRates& rates) {
  net::MasterLink::Values values{{"rss_mb", net::resident_mb()}, {"peak_rss_mb", net::peak_resident_mb()}};
  if (requests) {
    values["messages_rejected"] = double(requests->rejected());
    values["keys_refused"] = double(requests->keys_refused());
    values["connections_refused"] = double(requests->connections_refused());
    values["messages_refused"] = double(rates.refused());
    values["queue_refused"] = double(requests->queue_refused());
  }
  served.add_status(values);
  return values;
}

// Returns the data set's additions to the record of a run.
Recorded recorded(const DataServiceOptions& o, const Served& served) {
  Recorded out{.facts = {{metrics::kRecordFact, record_of(o, served)}}, .files = files_of(o, served.kind())};
  std::error_code error;
  if (!out.files.empty())
    out.facts["data_file"] = std::filesystem::absolute(o.scene, error).lexically_normal().string();
  return out;
}

// Logs the notes, and sends them to the launcher, which shows them to users.
void tell_notes(const Served& served, bool to_stdout) {
  for (const auto& note : served.notes()) {
    log::warn("{}", note);
    if (to_stdout) std::printf("note telesplat: %s\n", note.c_str());
  }
  std::fflush(stdout);
}

void answer_some(Served& served, const Outlets& outlets, net::PeerRates& rates) {
  for (int n = 0; n < kRequestsATurn; ++n) {
    const auto message = outlets.requests.receive();
    if (!message) break;
    if (rates.admit(message->peer, monotonic_s()))
      served.answer(*message, outlets);
    else
      outlets.requests.reject(*message, "its peer sends more than --max-messages");
  }
  served.send_finished(outlets);
}

}  // namespace

wire::Hello make_hello(const Served& served, const std::string& name, const std::string& endpoint) {
  wire::Hello hello;
  hello.role = "data";
  hello.name = to_utf8(name);
  hello.facts = {{"kind", std::string(scene::name_of(served.kind()))}, {"scene", to_utf8(served.title())}};
  if (!endpoint.empty()) hello.endpoints = {{std::string(served.requests().endpoint), endpoint}};
  served.describe(hello);
  std::string remarks;
  for (const std::string& note : served.notes())
    if (remarks.size() + note.size() < kMostRemarks) remarks += note + "\n";
  if (!remarks.empty()) hello.facts["remarks"] = to_utf8(remarks);
  return hello;
}

namespace {

class DataTurns final : public DataService {
 public:
  DataTurns(net::Context& context, Served& served, const net::ServiceOptions& o, RequestDoor door,
            const Recorded& recorded, std::function<bool()> stop)
      : served_(served),
        stop_(std::move(stop)),
        requests_(std::move(door.socket)),
        link_(context, o.master, hello_of(o.name, door.endpoint, recorded), o.give_up_after_s),
        hash_(recorded.files),
        rates_(o.max_messages) {
    served_.begin(link_.instance());
    link_.on_order([&](const wire::Order& order) {
      const auto answer = served_.carry_out(order);
      if (!answer) return link_.answer(order.number, false, answer.error().text);
      if (*answer) link_.answer(order.number, true, **answer);
    });
  }

  std::optional<net::Wait> turn() override {
    receive();
    const auto status = [&] { return status_of(served_, requests_, rates_); };
    if (failed() || net::stop_requested() || link_.shutdown_requested() || (stop_ && stop_())) {
      link_.leave(status);
      return std::nullopt;
    }
    link_.tick(monotonic_s(), status);
    net::Wait wait{{&link_.socket()}, served_.busy() ? kBusy_s : kQuiet_s};
    if (requests_) wait.sockets.push_back(&*requests_);
    return wait;
  }
  int exit_code() const override { return served_.failure() ? link_.exit_code() : 2; }

 private:
  bool failed() const {
    const Status failure = served_.failure();
    if (!failure) log::error("{}", failure.error().text);
    return !failure;
  }
  wire::Hello hello_of(const std::string& name, const std::string& endpoint, const Recorded& recorded) const {
    wire::Hello hello = make_hello(served_, name, endpoint);
    for (const auto& [fact, value] : recorded.facts) hello.facts[fact] = value;
    return hello;
  }
  void receive() {
    link_.receive();
    if (link_.version() != version_) {
      version_ = link_.version();
      if (const Status s = served_.follow(*link_.session()); !s) log::warn("{}", s.error().text);
    }
    if (requests_) answer_some(served_, {*requests_, link_.socket()}, rates_);
    for (const auto& [fact, value] : served_.news()) link_.tell(fact, value);
    if (served_.take_changed()) {
      wire::Hello changed = make_hello(served_, "", "");
      changed.facts.try_emplace("remarks");  // else those from before stay
      link_.tell(changed);
    }
    if (const auto known = hash_.take()) {
      link_.tell("data_bytes", std::to_string(known->bytes));
      link_.tell("data_hash", hash_text(known->hash));
    }
  }

  Served& served_;
  const std::function<bool()> stop_;
  std::optional<net::Socket> requests_;
  net::MasterLink link_;
  BackgroundHash hash_;
  net::PeerRates rates_;
  int version_ = 0;
};

}  // namespace

Result<std::unique_ptr<DataService>> DataService::open(net::Context& context, Served& served,
                                                       const net::ServiceOptions& o, const Recorded& recorded,
                                                       std::function<bool()> stop) {
  auto door = bind_requests(context, served.requests(), o);
  if (!door) return door.error();
  return {std::make_unique<DataTurns>(context, served, o, *std::move(door), recorded, std::move(stop))};
}

int serve(net::Context& context, Served& served, const net::ServiceOptions& o, const std::function<bool()>& stop,
          const Recorded& recorded) {
  const auto service = DataService::open(context, served, o, recorded, stop);
  if (!service) {
    log::error("{}", service.error().text);
    return 2;
  }
  net::take_turns(**service);
  return (*service)->exit_code();
}

Result<int> run(const DataServiceOptions& o) {
  const auto access = net::begin_service(o.service, {net::Role::kData}, true);
  if (!access) return access.error();
  net::end_on_signals();  // a signal while reading ends the process: the next start reads anew
  const double begin_s = monotonic_s();
  end_at_cut_off_files(2);
  if (const Status s = check_companions(o); !s) return s.error();
  const auto served = open(o, make_progress(o.report_progress, o.scene));
  if (!served) return served.error();
  // A file that is cut off from now on is the chunk store or a later step of a series: another start may succeed.
  end_at_cut_off_files(1);
  net::install_signal_handlers();
  log::info("{}: {}; ready in {:.0f} ms", o.scene, (*served)->summary(), 1e3 * (monotonic_s() - begin_s));
  tell_notes(**served, o.report_progress);
  net::Context context(*access);
  return serve(
      context, **served, o.service, [] { return false; }, recorded(o, **served));
}

}  // namespace telesplat::data
