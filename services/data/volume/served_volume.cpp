#include "services/data/volume/served_volume.h"

#include <fmt/format.h>

#include <condition_variable>
#include <exception>
#include <filesystem>
#include <optional>
#include <thread>

#include "common/net/dispatch.h"
#include "services/data/volume/answers.h"

namespace telesplat::data {
namespace {

// Answers requests, in a thread if it has one.
class Worker {
 public:
  Worker(VolumeAnswers& answers, InstanceId self, VolumeWorker who) : answers_(answers), self_(self) {
    if (who == VolumeWorker::kThread) thread_.emplace([this](const std::stop_token& stop) { run(stop); });
  }
  ~Worker() {
    if (thread_) thread_->request_stop();
    wake_.notify_one();
  }
  /// Wakes the thread: there may be work.
  void wake() {
    { const std::lock_guard lock(mutex_); }  // not between the thread's check for work and its wait
    wake_.notify_one();
  }
  bool busy() const {
    const std::lock_guard lock(mutex_);
    return working_ || !done_.empty() || answers_.has_work();
  }
  /// Returns finished answers; rethrows the exception that ended the thread. Without a thread it answers one request.
  std::vector<VolumeAnswers::Reply> take() {
    const std::lock_guard lock(mutex_);
    if (!thread_)
      if (auto reply = answers_.work(self_)) done_.push_back(std::move(*reply));
    if (failed_) std::rethrow_exception(std::exchange(failed_, nullptr));
    return std::exchange(done_, {});
  }

 private:
  // An exception (out of memory) goes to the caller of take().
  void run(const std::stop_token& stop) {
    try {
      loop(stop);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      working_ = false;
      failed_ = std::current_exception();
    }
  }

  void loop(const std::stop_token& stop) {
    std::unique_lock lock(mutex_);
    while (!stop.stop_requested()) {
      // Answers that are not taken yet keep a bounded memory.
      if (done_.size() >= kRepliesWaiting || !answers_.has_work()) {
        wake_.wait_for(lock, std::chrono::milliseconds(50));
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
  std::exception_ptr failed_;
  std::vector<VolumeAnswers::Reply> done_;
  std::optional<std::jthread> thread_;  // last, because it uses the others
};

class ServedVolume final : public Served {
 public:
  ServedVolume(std::shared_ptr<VolumeStore> store, std::string title, VolumeWorker who)
      : store_(std::move(store)), title_(std::move(title)), who_(who), answers_(*store_) {}

  scene::Kind kind() const override { return scene::Kind::kVolume; }
  std::string title() const override { return title_; }
  std::string summary() const override;
  std::vector<std::string> notes() const override {
    if (store_->remark().empty()) return {};
    return {title_ + ": " + store_->remark()};
  }
  void describe(wire::Hello& hello) const override;
  // Few answers are queued per peer: they are large, and samplers ask for one at a time.
  Requests requests() const override { return {"voxels", 8}; }

  void begin(InstanceId self) override { worker_.emplace(answers_, self, who_); }
  Status follow(const wire::Welcome& session) override {
    const Status followed = answers_.follow(session);
    worker_->wake();
    return followed;
  }
  Result<std::optional<std::string>> carry_out(const wire::Order& order) override {
    if (order.command != "probe") return Served::carry_out(order);
    const Status queued = answers_.probe(order);
    if (!queued) return queued.error();
    worker_->wake();
    return std::optional<std::string>();
  }
  void answer(const net::Message& message, const Outlets& outlets) override {
    net::dispatch<wire::VoxelRequest>(outlets.requests, message, [&](const wire::VoxelRequest& request) {
      ++asked_;
      auto reply = answers_.ask(message.peer, request);
      if (!reply)
        outlets.requests.reject(message, reply.error().text);
      else if (*reply)
        send(std::move(**reply), outlets);
      else
        worker_->wake();
    });
  }
  void send_finished(const Outlets& outlets) override {
    auto done = worker_->take();
    if (!done.empty()) worker_->wake();
    for (auto& reply : done) send(std::move(reply), outlets);
  }
  bool busy() const override { return worker_->busy(); }
  void add_status(std::map<std::string, double>& values) const override {
    values["requests"] = double(asked_);
    values["bytes_sent"] = double(bytes_);
    values["voxels_sent"] = double(voxels_);
    values["bytes_per_voxel"] = voxels_ ? double(bytes_) / double(voxels_) : 0;
  }

 private:
  void send(VolumeAnswers::Reply reply, const Outlets& outlets) {
    net::Socket& to = reply.peer.empty() ? outlets.master : outlets.requests;
    if (to.send_frames(reply.peer, reply.type, std::move(reply.body))) bytes_ += reply.bytes, voxels_ += reply.voxels;
  }

  const std::shared_ptr<VolumeStore> store_;
  const std::string title_;
  const VolumeWorker who_;
  uint64_t asked_ = 0, bytes_ = 0, voxels_ = 0;
  VolumeAnswers answers_;
  std::optional<Worker> worker_;  // from begin() on; last, because its thread uses the others
};

std::string ServedVolume::summary() const {
  const volume::Session& session = store_->session();
  const auto& size = session.grid.size;
  const auto& range = session.range;
  return fmt::format("{} x {} x {} voxels{}, values {:g} to {:g} (mostly {:g} to {:g}{}) in {} levels", size[0],
                     size[1], size[2], session.steps > 1 ? fmt::format(", {} steps", session.steps) : "", range.lo,
                     range.hi, range.typical_lo, range.typical_hi, range.hounsfield ? ", Hounsfield units" : "",
                     session.levels.count);
}

void ServedVolume::describe(wire::Hello& hello) const {
  const volume::Session& session = store_->session();
  const auto& size = session.grid.size;
  hello.facts.merge(volume::to_facts(session));
  hello.facts.insert({{volume::kHistogramFact, volume::to_text(store_->histogram())},
                      {"format", store_->format()},
                      {"primitives", std::to_string(session.grid.voxels())},
                      {"voxels", std::to_string(session.grid.voxels())},
                      {"content_hash", fmt::format("{:016x}", store_->content_hash())},
                      {"size", fmt::format("{} x {} x {}", size[0], size[1], size[2])}});
  hello.facts[scene::kPlacementFact] = scene::to_text(store_->placement());
  hello.parameters = volume::to_parameters(session);
  hello.box_room = session.grid.box_room();
}

}  // namespace

std::unique_ptr<Served> serve_volume(std::shared_ptr<VolumeStore> store, const std::string& path, VolumeWorker worker) {
  std::filesystem::path file = std::filesystem::path(path).lexically_normal();
  if (!file.has_filename()) file = file.parent_path();  // a folder's name that ends in a slash
  return std::make_unique<ServedVolume>(std::move(store), file.filename().string(), worker);
}

}  // namespace telesplat::data
