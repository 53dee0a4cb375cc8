#include "services/data/volume/service.h"

#include <condition_variable>
#include <filesystem>
#include <thread>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/net/master_link.h"
#include "services/data/volume/answers.h"

namespace telesplat::data {
namespace {

constexpr int kQuiet_ms = 50,
              kBusy_ms = 2;  // how long the loop waits for messages; while something is worked on, its end ends no wait

wire::Hello make_hello(const DataServiceOptions& o, const VolumeStore& store, const std::string& endpoint) {
  const volume::Session& session = store.session();
  const auto& size = session.grid.size;
  wire::Hello hello;
  hello.role = "data";
  hello.name = o.service.name;
  hello.endpoints = {{"voxels", endpoint}};
  hello.facts = volume::to_facts(session);
  hello.facts.insert({{"scene", std::filesystem::path(o.scene).lexically_normal().filename().string()},
                      {"kind", "volume"},
                      {"format", store.format()},
                      {"voxels", std::to_string(session.grid.voxels())},
                      {"content_hash", fmt::format("{:016x}", store.content_hash())},
                      {"size", fmt::format("{} x {} x {}", size[0], size[1], size[2])}});
  hello.parameters = volume::to_parameters(session);
  hello.box_room = session.grid.box_room();
  return hello;
}

// The thread that works off requests, so that the loop keeps talking to the master meanwhile.
class Worker {
 public:
  Worker(VolumeAnswers& answers, InstanceId self)
      : answers_(answers), self_(self), thread_([this](const std::stop_token& stop) { run(stop); }) {}
  ~Worker() {
    thread_.request_stop();
    wake_.notify_one();
  }
  /// There may be something to do.
  void wake() {
    { const std::lock_guard lock(mutex_); }  // not between its look at what there is to do and its wait
    wake_.notify_one();
  }
  bool busy() const {
    const std::lock_guard lock(mutex_);
    return working_ || !done_.empty() || answers_.has_work();
  }
  std::vector<VolumeAnswers::Reply> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(done_, {});
  }

 private:
  void run(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      // What is done and not taken yet stays within memory.
      if (done_.size() >= kRepliesWaiting || !answers_.has_work()) {
        wake_.wait_for(lock, std::chrono::milliseconds(kQuiet_ms));
        continue;
      }
      working_ = true;
      lock.unlock();
      auto reply = answers_.work(self_);
      lock.lock();
      working_ = false;
      if (reply) done_.push_back(std::move(*reply));
    }
  }

  static constexpr size_t kRepliesWaiting = 4;
  VolumeAnswers& answers_;
  const InstanceId self_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool working_ = false;
  std::vector<VolumeAnswers::Reply> done_;
  std::jthread thread_;  // last: it uses the others
};

}  // namespace

int serve_volume(net::Context& context, VolumeStore& store, const DataServiceOptions& o,
                 const std::function<bool()>& stop) {
  // Few answers wait for a peer: they are large, and samplers ask for one at a time.
  net::Socket requests(context, net::Kind::kRouter, o.service.name + ":voxels", {.high_water_mark = 8});
  const auto endpoint = requests.bind(o.service.bind, o.service.insecure);
  if (!endpoint) {
    log::error("{}", endpoint.error().text);
    return 2;
  }
  net::MasterLink link(context, o.service.master, make_hello(o, store, net::announced(*endpoint, o.service.advertise)));
  VolumeAnswers answers(store);
  Worker worker(answers, link.instance());
  uint64_t asked = 0, bytes = 0, voxels = 0;
  const auto status = [&] {
    return net::MasterLink::Values{{"rss_mb", net::resident_mb()},
                                   {"peak_rss_mb", net::peak_resident_mb()},
                                   {"messages_rejected", double(requests.rejected())},
                                   {"requests", double(asked)},
                                   {"bytes_sent", double(bytes)},
                                   {"voxels_sent", double(voxels)},
                                   {"bytes_per_voxel", voxels ? double(bytes) / double(voxels) : 0}};
  };
  const auto send = [&](VolumeAnswers::Reply reply) {
    const bool to_master = reply.peer.empty();
    if ((to_master ? link.socket() : requests).send_frames(reply.peer, reply.type, std::move(reply.body)))
      bytes += reply.bytes, voxels += reply.voxels;
  };

  int version = 0;
  while (!net::stop_requested() && !link.shutdown_requested() && !stop()) {
    link.tick(monotonic_s(), status);
    net::wait_readable({&requests, &link.socket()}, worker.busy() ? kBusy_ms : kQuiet_ms);
    while (const auto message = link.socket().receive())
      if (!link.handle(*message, monotonic_s())) link.socket().reject(*message, "its type is not expected here");
    if (link.version() != version) {
      version = link.version();
      if (const Status s = answers.follow(*link.session()); !s) log::warn("{}", s.error().text);
      worker.wake();
    }
    for (int n = 0; n < 64; ++n) {
      const auto message = requests.receive();
      if (!message) break;
      net::dispatch<wire::VoxelRequest>(requests, *message, [&](const wire::VoxelRequest& request) {
        ++asked;
        auto reply = answers.ask(message->peer, request);
        if (!reply)
          requests.reject(*message, reply.error().text);
        else if (*reply)
          send(std::move(**reply));
        else
          worker.wake();
      });
    }
    auto done = worker.take();
    if (!done.empty()) worker.wake();
    for (auto& reply : done) send(std::move(reply));
  }
  link.leave(status);
  return 0;
}

}  // namespace telesplat::data
