#include "services/sampler/sampler_service.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "common/core/clock.h"
#include "common/core/guarded.h"
#include "common/core/machine.h"
#include "common/metrics/recorder.h"
#include "common/net/master_link.h"
#include "common/options/complain.h"
#include "common/scene/session.h"
#include "services/sampler/mesh/sampler.h"
#include "services/sampler/tiles/work.h"
#include "services/sampler/works.h"

namespace telesplat::sampler {
namespace {

constexpr int kLeases = 2;              // held and asked for: one that is sampled, and one to go on with at once
constexpr double kIdle_s = 0.1;         // the longest wait: then status reports and hellos are due
constexpr double kSpanFlush_s = 1;      // between two messages of spans
constexpr double kSendAgain_s = 0.025;  // between two tries to send
constexpr double kSendFor_s = 1;        // tries go on for this long: the packer may be slow, or restarted
constexpr std::chrono::duration<double> kLook{0.2};  // a stop is noticed this late at most

// A sampler begins no lease later than this after a signal to stop.
constexpr double kDrain_s = 0.8;
// This long after the signal it ends, even in the middle of a lease: its manager may kill it after two seconds.
constexpr double kStop_s = 1.3;

// Makes a sampler end in time after a signal to stop, even in the middle of a lease that never ends.
class DrainGuard {
 public:
  // Watches net::stop_requested() from now on. If the process still runs kStop_s after the signal, says goodbye to the
  // master in the name of `instance`, so that its leases go to others at once, and ends the process with code 0.
  DrainGuard(const std::string& master, InstanceId instance, net::Access access = {});
  ~DrainGuard();

 private:
  void watch(const std::string& master, InstanceId instance, const net::Access& access);

  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

DrainGuard::DrainGuard(const std::string& master, InstanceId instance, net::Access access)
    : thread_([this, master, instance, access = std::move(access)] { watch(master, instance, access); }) {}

DrainGuard::~DrainGuard() {
  {
    const std::lock_guard lock(mutex_);
    done_ = true;
  }
  wake_.notify_all();
  thread_.join();
}

void DrainGuard::watch(const std::string& master, InstanceId instance, const net::Access& access) {
  std::unique_lock lock(mutex_);
  const auto done = [this] { return done_; };
  while (!net::stop_requested())
    if (wake_.wait_for(lock, kLook, done)) return;
  if (wake_.wait_for(lock, std::chrono::duration<double>(kStop_s), done)) return;
  log::warn("told to stop, and a lease takes too long: it is given up");
  const Status told = guarded("saying goodbye", [&] {
    // The service's own socket belongs to the thread that is busy.
    net::Context context(access);
    net::Socket socket(context, net::Kind::kDealer, "goodbye");
    if (socket.connect(master)) socket.send(wire::Goodbye{instance});
  });
  std::_Exit(told ? 0 : 1);
}

class SamplerTurns final : public SamplerService {
 public:
  /// mesh_sampler: made beforehand, or null.
  SamplerTurns(const SamplerOptions& o, InstanceId instance, std::unique_ptr<Sampler> mesh_sampler,
               net::Context& context)
      : options_(o),
        context_(context),
        mesh_sampler_(std::move(mesh_sampler)),
        link_(context, o.service.master, make_hello(o, instance), o.service.give_up_after_s) {}

  std::optional<net::Wait> turn() override {
    receive_control(!give_up_s_);
    if (work_) work_->receive(monotonic_s());
    // Messages that came meanwhile may have changed the lease's epoch.
    if (std::exchange(ready_, false) && look_at_next(monotonic_s()).state == Readiness::State::kReady && held() > 0)
      sample_next();
    const double now = monotonic_s();
    if (net::stop_requested() && !give_up_s_) give_up_s_ = now + kDrain_s;
    if (link_.shutdown_requested() || failed_) return leave();
    link_.tick(now, [&] { return status(); });
    flush_metrics(now);
    send_out(now);
    const Readiness next = look_at_next(now);
    ready_ = held() > 0 && next.state == Readiness::State::kReady && !unsent_;
    if (drained(ready_, next, now)) return leave();
    if (!give_up_s_) ask_for_leases();
    if (work_) work_->fetch(now);
    if (ready_) return net::Wait{};
    net::Wait wait{{&link_.socket()}, std::max(0.0, std::min(unsent_ ? kSendAgain_s : next.again_s - now, kIdle_s))};
    if (work_)
      for (net::Socket* s : work_->sockets()) wait.sockets.push_back(s);
    return wait;
  }

  int exit_code() const override { return link_.exit_code() ? link_.exit_code() : int(failed_); }

 private:
  std::optional<net::Wait> leave() {
    flush_metrics(1e300);
    link_.leave([&] { return status(); });
    return std::nullopt;
  }

  static wire::Hello make_hello(const SamplerOptions& o, InstanceId instance) {
    wire::Hello hello;
    hello.role = "sampler";
    hello.name = o.service.name;
    hello.instance = instance;
    hello.facts = {{"sampler", o.kind}, {"threads", std::to_string(o.threads)}, {"leases", std::to_string(kLeases)}};
    if (!o.service.link.empty()) hello.facts["link"] = o.service.link;
    return hello;
  }

  net::MasterLink::Values status() const {
    net::MasterLink::Values values{{"rss_mb", net::resident_mb()},
                                   {"peak_rss_mb", net::peak_resident_mb()},
                                   {"tiles_sampled", double(tiles_sampled_)},
                                   {"busy_s", busy_s_},
                                   {"leases_held", double(held())}};
    if (work_) work_->add_status(values);
    return values;
  }

  void flush_metrics(double now_s) {
    if (now_s - last_flush_s_ < kSpanFlush_s) return;
    last_flush_s_ = now_s;
    if (const auto rows = spans_.flush(link_.instance())) link_.socket().send(*rows);
  }

  // True if it may leave after a signal to stop: it finishes the leases that it can sample soon. The master gives the
  // others to other samplers after our goodbye.
  bool drained(bool ready, const Readiness& next, double now_s) const {
    if (!give_up_s_) return false;
    const bool waits = unsent_ || (held() > 0 && next.again_s < *give_up_s_);
    return (!ready && !waits) || now_s > *give_up_s_;
  }

  size_t held() const { return work_ ? work_->leases() : 0; }
  Readiness look_at_next(double now_s) {
    return work_ ? work_->look_at_next(now_s) : Readiness{Readiness::State::kWaits};
  }

  // Every welcome counts: a later one may be of another epoch whose leases are already on their way.
  void on_welcome() {
    const wire::Welcome& session = *link_.session();
    if (session.master != master_) {  // another master knows nothing of the leases we asked for
      master_ = session.master;
      leases_asked_ = 0;
      unsent_.reset();
      if (work_) work_->drop_leases();
    }
    const scene::SessionView view(session);
    connect_to_packer(view.endpoint("tiles"));
    follow_kind(view.fact("kind"));
    if (work_) work_->on_welcome(session);
  }

  void connect_to_packer(const std::string& endpoint) {
    if (endpoint.empty() || endpoint == tiles_endpoint_) return;
    tiles_endpoint_ = endpoint;
    tiles_.emplace(context_, net::Kind::kPush, options_.service.name + ":tiles",
                   net::SocketOptions{.high_water_mark = 64, .patience_s = net::kBulkPatience_s});
    if (const Status s = tiles_->connect(endpoint); !s) log::error("{}", s.error().text);
  }

  // Makes new work if the session's scene is of another kind.
  void follow_kind(const std::string& name) {
    if (name.empty() || name == kind_) return;
    kind_ = name;
    work_.reset();
    const auto kind = scene::kind_named(name);
    if (!kind) return log::error("the session's data are of the unknown kind '{}'", name.substr(0, 64));
    auto made = make_work(*kind, {options_, context_, link_, spans_, mesh_sampler_});
    if (made) return set_work(std::move(*made));
    log::error("{}", made.error().text);
    failed_ = true;
  }

  void set_work(std::unique_ptr<Work> work) {
    work_ = std::move(work);
    link_.tell("sampler", work_->name());
  }

  void ask_for_leases() {
    if (!tiles_ || !work_ || !work_->takes_leases()) return;
    while (leases_asked_ + int(held()) < kLeases) {
      link_.socket().send(wire::LeaseRequest{link_.instance()});
      ++leases_asked_;
    }
  }

  void receive_control(bool takes_leases) {
    while (const auto message = link_.socket().receive()) {
      const double now = monotonic_s();
      const int version = link_.version();
      if (link_.handle(*message)) {
        if (message->type == wire::WhoAreYou::kName) leases_asked_ = 0;
        if (link_.version() != version) on_welcome();
        continue;
      }
      // A lease that cannot be decoded is an answer, too.
      if (message->type == wire::Lease::kName || message->type == wire::SliceLease::kName)
        leases_asked_ = std::max(0, leases_asked_ - 1);
      if (work_)
        work_->take(link_.socket(), *message, takes_leases && tiles_, now);
      else
        link_.socket().reject(*message, "nothing is sampled yet");
    }
  }

  void sample_next() {
    if (!net::stop_requested()) ask_for_leases();  // the answer comes while we sample
    Delivery made = work_->sample_next();
    ++tiles_sampled_;
    busy_s_ += std::max(0.0, made.encoded_s - made.begin_s);
    spans_.add("sample", link_.to_master_s(made.begin_s), link_.to_master_s(made.sampled_s), 0, made.of);
    spans_.add("encode", link_.to_master_s(made.sampled_s), link_.to_master_s(made.encoded_s), 0, made.of);
    unsent_ = std::move(made);
    send_out(monotonic_s());
  }

  // If the packer is slow or being restarted, holds the message for kSendFor_s. Then its lease may expire.
  void send_out(double now_s) {
    if (!unsent_) return;
    if ((tiles_ && tiles_->send_frames({}, unsent_->type, unsent_->body)) || now_s > unsent_->encoded_s + kSendFor_s)
      unsent_.reset();
  }

  const SamplerOptions& options_;
  net::Context& context_;
  std::unique_ptr<Sampler> mesh_sampler_;
  metrics::SpanRecorder spans_;
  net::MasterLink link_;
  std::unique_ptr<Work> work_;  // null: the session's kind is not known yet
  std::optional<net::Socket> tiles_;
  std::string tiles_endpoint_, kind_;
  InstanceId master_;
  std::optional<Delivery> unsent_;
  std::optional<double> give_up_s_;  // set after a signal to stop
  int leases_asked_ = 0;
  bool failed_ = false;
  bool ready_ = false;  // the first lease may be sampled once waiting messages are taken
  uint64_t tiles_sampled_ = 0;
  double busy_s_ = 0;  // sampling and encoding
  double last_flush_s_ = 0;
};

}  // namespace

std::unique_ptr<SamplerService> SamplerService::open(net::Context& context, const SamplerOptions& o,
                                                     std::unique_ptr<Sampler> mesh_sampler) {
  return std::make_unique<SamplerTurns>(o, net::make_instance_id(), std::move(mesh_sampler), context);
}

Result<int> run(const SamplerOptions& given) {
  SamplerOptions o = given;
  if (o.threads == 0) o.threads = usable_processors();
  const auto access = net::begin_service(o.service, {net::Role::kSampler});
  if (!access) return access.error();
  net::keep_freed_memory();
  std::unique_ptr<Sampler> sampler;
  if (o.kind != "auto") {  // if it cannot be made, report it now, not when a session comes
    auto made = make_sampler(o.kind, o.threads);
    if (!made) return complain(made.error(), 1);
    sampler = std::move(*made);
  }
  const InstanceId instance = net::make_instance_id();
  const DrainGuard guard(o.service.master, instance, *access);
  net::Context context(*access);
  SamplerTurns service(o, instance, std::move(sampler), context);
  net::take_turns(service);
  return service.exit_code();
}

}  // namespace telesplat::sampler
