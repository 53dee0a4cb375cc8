#include "services/packer/packer_service.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string_view>
#include <utility>

#include "common/core/clock.h"
#include "common/metrics/recorder.h"
#include "common/net/connections/peer_rates.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "services/packer/packer_options.h"
#include "services/packer/packing.h"
#include "services/packer/pictures/picture_packing.h"
#include "services/packer/points/point_packing.h"
#include "services/packer/slices/slice_packing.h"

namespace telesplat::packer {
namespace {

constexpr double kSpanFlush_s = 1, kLongestWait_s = 0.05;
constexpr int kRecordedImages = 50;   // at most, for --record-depth
constexpr double kKeepFreed_s = 10;   // memory unused for this long goes back to the system
constexpr double kOnTheirWay_s = 30;  // after a change, messages of the previous data set may still arrive
constexpr int kSampledAtOnce = 8;     // then control messages and viewers get their turn
constexpr int kStateAtOnce = 64;
constexpr int kStateQueue = 1 << 16;  // messages that wait for a viewer: more than StateAnswers has under way

template <class... M>
bool is_any(std::string_view type) {
  return ((type == M::kName) || ...);
}
bool belongs(std::string_view type, scene::Pipeline pipeline) {
  if (pipeline == scene::Pipeline::kSlices) return is_any<wire::SliceImages, wire::SliceAck>(type);
  if (pipeline == scene::Pipeline::kPictures) return is_any<wire::PictureTile, wire::SliceAck>(type);
  return is_any<wire::DepthTile, wire::StateRequest, wire::AccessReport, wire::Receipt, wire::BaseRequest>(type);
}

class PackerTurns final : public PackerService {
 public:
  PackerTurns(const PackerOptions& o, net::Context& context)
      : options_(o),
        context_(context),
        tiles_(context, net::Kind::kPull, o.service.name + ":tiles",
               {.high_water_mark = 16,
                .max_message_bytes = wire::kMaxBulkBytes + wire::kMaxControlBytes,
                .patience_s = net::kBulkPatience_s,
                .read_ahead = true,
                .serves = "tiles",
                .most_connections = o.service.max_connections}),
        patches_(context, net::Kind::kPub, o.service.name + ":patches",
                 {.high_water_mark = 4096,
                  .patience_s = net::kBulkPatience_s,
                  .serves = "patches",
                  .most_connections = o.service.max_connections,
                  .most_queued_bytes = o.service.queue_limit_bytes()}),
        state_(context, net::Kind::kRouter, o.service.name + ":state",
               {.high_water_mark = kStateQueue,
                .max_message_bytes = 16u << 20,
                .patience_s = net::kBulkPatience_s,
                .serves = "state",
                .most_connections = o.service.max_connections,
                .most_queued_bytes = o.service.queue_limit_bytes()}),
        rates_(o.service.max_messages) {}

  /// Binds the three sockets and says hello with their addresses.
  Status open() {
    wire::Hello hello;
    hello.role = "packer";
    hello.name = options_.service.name;
    int n = 0;
    for (const auto& [socket, key, host] : {std::tuple{&patches_, "patches", for_viewers()},
                                            {&state_, "state", for_viewers()},
                                            {&tiles_, "tiles", options_.service.advertise}}) {
      const auto bind = bind_of(options_.service.bind, n++);
      if (!bind) return bind.error();
      const auto endpoint = socket->bind(*bind, options_.service.insecure);
      if (!endpoint) return endpoint.error();
      hello.endpoints[key] = net::announced(*endpoint, host);
    }
    if (!options_.record_depth.empty()) {
      auto recorder = DepthRecorder::open(options_.record_depth, kRecordedImages);
      if (!recorder) return recorder.error();
      recorder_ = std::move(*recorder);
    }
    link_.emplace(context_, options_.service.master, hello, options_.service.give_up_after_s);
    return ok_status();
  }

  std::optional<net::Wait> turn() override {
    receive_control();
    receive(state_, kStateAtOnce, &Packing::take_state);
    receive(tiles_, kSampledAtOnce, &Packing::take_sampled);
    if (packing_) packing_->receive();
    if (net::stop_requested() || link_->shutdown_requested()) {
      flush_spans(1e300);
      link_->leave([&] { return status(); });
      return std::nullopt;
    }
    const double now = monotonic_s();
    link_->tick(now, [&] { return status(); });
    early_.expire(now);
    if (packing_) packing_->tick(now);
    flush_spans(now);
    std::vector<net::Socket*> sockets{&link_->socket(), &tiles_, &state_};
    if (packing_) std::ranges::copy(packing_->sockets(), std::back_inserter(sockets));
    if (net::wait_readable(sockets, 0) || use_spare_time(now)) return net::Wait{};
    return_freed_memory(now);
    return net::Wait{sockets, longest_wait_s()};
  }

  int exit_code() const override {
    if (const int code = link_->exit_code()) return code;
    const auto values = status();
    const auto failed = values.find(metrics::kRecordFailed);
    return failed != values.end() && failed->second > 0 ? 1 : 0;
  }

 private:
  using Take = void (Packing::*)(net::Socket&, const net::Message&, double);
  struct Early {
    net::Socket* from;
    net::Message message;
    Take take;
  };

  const std::string& for_viewers() const {
    return options_.advertise_to_viewers.empty() ? options_.service.advertise : options_.advertise_to_viewers;
  }

  void receive_control() {
    while (const auto message = link_->socket().receive()) {
      const double now_s = monotonic_s();
      if (!link_->handle(*message))
        net::dispatch<wire::PlanRequest, wire::FrameEnd>(link_->socket(), *message,
                                                         [&](const auto& m) { on(m, now_s); });
      follow_news();
    }
  }

  void follow_news() {
    if (link_->session() && link_->version() != seen_version_) {
      seen_version_ = link_->version();
      follow(*link_->session(), monotonic_s());
    }
  }

  void on(const wire::FrameEnd& end, double now_s) {
    if (packing_) packing_->end_frame(end, now_s);
  }

  // Requests for rays beyond a view wait for spare time: planning them takes as long as planning a view.
  void on(const wire::PlanRequest& request, double now_s) {
    if (request.extra && packing_) return spare_.keep(request);
    if (!request.extra) spare_.follow(request);
    link_->socket().send(packing_ ? packing_->plan(request, now_s) : all_rays(request));
  }

  // Returns the time until work is due that no message announces, s.
  double longest_wait_s() const {
    const auto due_s = packing_ ? packing_->due_s() : std::nullopt;
    if (!due_s) return kLongestWait_s;
    // Rounded up to whole milliseconds: a message ends the wait at any moment within them.
    return std::ceil(std::clamp(*due_s - monotonic_s(), 0.001, kLongestWait_s) * 1e3) * 1e-3 + 1e-6;
  }

  // Does one piece of deferrable work. False: no such work, or it must wait.
  bool use_spare_time(double now_s) {
    const bool hurried = packing_ && packing_->hurried(now_s);
    if (!packing_ || !spare_.begins(now_s, hurried)) return false;
    const wire::PlanRequest* question = spare_.question(now_s);
    // Where a view is always under way, the packer also always has something to learn: the two take turns.
    const bool questions_turn = question && hurried && settled_;
    if (settled_ = !questions_turn && packing_->idle(now_s); settled_) return true;
    if (!question) return false;
    const double begin_s = monotonic_s();
    const auto plan = packing_->plan_piece(*question, now_s);
    if (plan) link_->socket().send(*plan);
    spare_.worked(begin_s, monotonic_s(), plan.has_value());
    return true;
  }

  // A session may change to another kind of scene, and with it to another pipeline.
  void follow(const wire::Welcome& session, double now_s) {
    if (packing_ && packing_->follow(session, now_s)) return;
    const auto pipeline = scene::SessionView(session).pipeline();
    if (!pipeline) return;
    packing_ = make_packing(*pipeline);
    before_ = std::exchange(pipeline_, pipeline), changed_s_ = now_s;
    packing_->follow(session, now_s);
    for (const auto& early : early_.take()) ((*packing_).*early.item.take)(*early.item.from, early.item.message, now_s);
  }

  // True for a message of the previous kind of scene: samplers and viewers learn of a change later than the packer.
  bool is_of_the_kind_before(std::string_view type) const {
    return before_ && monotonic_s() - changed_s_ < kOnTheirWay_s && belongs(type, *before_) &&
           !belongs(type, *pipeline_);
  }

  std::unique_ptr<Packing> make_packing(scene::Pipeline pipeline) {
    Outlets outlets{.tell = [this](const wire::TileDone& m) { link_->socket().send(m); },
                    .refuse = [this](const wire::TileRefused& m) { link_->socket().send(m); },
                    .to_viewers = [this](std::string_view type,
                                         std::string body) { patches_.send_frames({}, type, std::move(body)); },
                    .to_viewer = [this](std::string_view peer, std::string_view type,
                                        std::string body) { return state_.send_frames(peer, type, std::move(body)); },
                    .waiting = [this](const std::string& peer) { return state_.queued_bytes(peer); },
                    .tell_link = [this](const wire::LinkReport& m) { link_->socket().send(m); },
                    .master_now = [this] { return link_->to_master_s(monotonic_s()); },
                    .to_master_s = [this](double s) { return link_->to_master_s(s); }};
    if (pipeline == scene::Pipeline::kSlices) return std::make_unique<SlicePacking>(std::move(outlets), spans_);
    if (pipeline == scene::Pipeline::kPictures) return std::make_unique<PicturePacking>(std::move(outlets), spans_);
    const PointPacking::Options options{.threads = options_.threads,
                                        .max_log_bytes = uint64_t(options_.log_limit_mb * 1e6),
                                        .answers = {.window_bytes = uint64_t(options_.answer_window_mb * 1e6)},
                                        .recorder = recorder_ ? &*recorder_ : nullptr,
                                        .context = &context_};
    return std::make_unique<PointPacking>(options, std::move(outlets), spans_);
  }

  void receive(net::Socket& from, int most, Take take) {
    for (int n = 0; n < most; ++n) {
      const auto message = from.receive();
      if (!message) return;
      // Unread messages hold samplers back; viewers are limited by rate.
      if (&from == &state_ && !rates_.admit(message->peer, monotonic_s())) {
        from.reject(*message, "its peer sends more than --max-messages");
        continue;
      }
      const std::string* payer = &from == &state_ ? net::payer(*message) : nullptr;
      if (payer && !work_.admit(*payer, monotonic_s())) {
        from.reject(*message, "its sender takes more than its share of the packer's time");
        continue;
      }
      const double begin_s = thread_cpu_s();
      receive_control();  // a control message that came meanwhile may announce this message's epoch
      if (is_of_the_kind_before(message->type)) continue;
      if (packing_)
        ((*packing_).*take)(from, *message, monotonic_s());
      else
        early_.add({&from, *message, take}, message->body.size(), monotonic_s(), message->user);
      if (payer) work_.worked(*payer, thread_cpu_s() - begin_s, monotonic_s());
    }
  }

  net::MasterLink::Values status() const {
    net::MasterLink::Values v{
        {"rss_mb", net::resident_mb()},
        {"peak_rss_mb", net::peak_resident_mb()},
        {"bytes_sent", 0},
        {"messages_rejected", double(tiles_.rejected() + patches_.rejected() + state_.rejected())},
        {"keys_refused", double(tiles_.keys_refused() + patches_.keys_refused() + state_.keys_refused())},
        {"connections_refused",
         double(tiles_.connections_refused() + patches_.connections_refused() + state_.connections_refused())},
        {"messages_refused", double(rates_.refused() + work_.refused())},
        {"queue_refused", double(patches_.queue_refused() + state_.queue_refused())}};
    if (packing_) packing_->add_status(v);
    return v;
  }

  // Runs when the packer is idle. More viewers than usual, or a larger view, need more memory for a while.
  void return_freed_memory(double now_s) {
    if (now_s - last_return_s_ < kKeepFreed_s) return;
    last_return_s_ = now_s;
    net::return_freed_memory();
  }

  void flush_spans(double now_s) {
    if (now_s - last_flush_s_ < kSpanFlush_s) return;
    last_flush_s_ = now_s;
    if (const auto rows = spans_.flush(link_->instance())) link_->socket().send(*rows);
  }

  const PackerOptions& options_;
  net::Context& context_;
  net::Socket tiles_, patches_, state_;
  net::PeerRates rates_;  // message rates of viewers
  net::WorkShares work_;  // viewers' shares of the packer's time
  std::optional<net::MasterLink> link_;
  std::optional<DepthRecorder> recorder_;
  metrics::SpanRecorder spans_;
  std::unique_ptr<Packing> packing_;  // null until the session's kind is known
  std::optional<scene::Pipeline> pipeline_, before_;
  double changed_s_ = 0;
  EpochHold<Early> early_;  // messages that came before the session was known
  SpareTime spare_;
  bool settled_ = false;  // the last piece of spare time went into packing_->idle()
  int seen_version_ = 0;
  double last_flush_s_ = 0, last_return_s_ = 0;
};

}  // namespace

Result<std::unique_ptr<PackerService>> PackerService::open(net::Context& context, const PackerOptions& o) {
  auto out = std::make_unique<PackerTurns>(o, context);
  if (const Status s = out->open(); !s) return s.error();
  return {std::move(out)};
}

bool SpareTime::begins(double now_s, bool hurried) {
  if (hurried && now_s - rested_s_ < kLongestHurry_s) return false;
  rested_s_ = now_s;
  return true;
}

void SpareTime::follow(const wire::PlanRequest& view) {
  if (question_ && question_->viewer == view.viewer && question_->epoch == view.epoch)
    question_->camera = view.camera, question_->still = view.still;
}

const wire::PlanRequest* SpareTime::question(double now_s) const {
  return question_ && (question_->still || now_s >= next_s_) ? &*question_ : nullptr;
}

void SpareTime::worked(double from_s, double until_s, bool done) {
  next_s_ = from_s + (1 + kPause) * (until_s - from_s);
  if (done) question_.reset();
}

Result<int> run(const PackerOptions& o) {
  const auto access = net::begin_service(o.service, {net::Role::kPacker}, true);
  if (!access) return access.error();
  net::keep_freed_memory();
  net::Context context(*access);
  const auto service = PackerService::open(context, o);
  if (!service) return service.error();
  net::take_turns(**service);
  return (*service)->exit_code();
}

}  // namespace telesplat::packer
