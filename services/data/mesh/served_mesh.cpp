#include "services/data/mesh/served_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <exception>
#include <filesystem>
#include <future>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/scene/placement.h"
#include "common/scene/session.h"
#include "common/volume/histogram.h"
#include "services/data/base/epochs.h"
#include "services/data/base/placement_options.h"
#include "services/data/mesh/cast.h"

namespace telesplat::data {
namespace {

struct GivenUp {};

// Opens a store in a thread of its own.
class StoreOpening {
 public:
  using Made = Result<std::shared_ptr<MeshStore>>;
  StoreOpening() = default;
  StoreOpening(const StoreOpening&) = delete;
  /// Cancels it, and waits until its thread ends.
  ~StoreOpening() {
    stop_ = true;
    if (opening_.valid()) opening_.wait();
  }

  void begin(OpenStore open) {
    opening_ = std::async(std::launch::async, [this, open = std::move(open)]() -> Made {
      try {
        return open([this](const char* stage, double fraction) {
          if (stop_) throw GivenUp();
          stage_ = stage, fraction_ = fraction;
        });
      } catch (const GivenUp&) {
        return Error{"given up: the data server ends"};
      } catch (const std::exception& e) {
        return Error{e.what()};
      }
    });
  }
  bool running() const { return opening_.valid(); }
  /// Returns what was opened; once.
  std::optional<Made> take() {
    if (!opening_.valid() || opening_.wait_for(std::chrono::seconds(0)) != std::future_status::ready)
      return std::nullopt;
    return opening_.get();
  }
  /// Fraction that is done, 0..1, by the time that stages take of a mesh of 52 million triangles.
  double fraction() const {
    double before = 0;
    for (const auto& [stage, part] : {std::pair{kIdentifying, 0.03},
                                      {kReading, 0.05},
                                      {kSortingIntoChunks, 0.1},
                                      {kWritingTheStore, 0.5},
                                      {kMakingLevels, 0.32}}) {
      if (stage_.load() == std::string_view(stage)) return before + part * fraction_;
      before += part;
    }
    return 0;
  }

 private:
  std::future<Made> opening_;
  std::atomic<bool> stop_{false};
  std::atomic<const char*> stage_ = "";
  std::atomic<double> fraction_ = 0;
};

// The open stores of one mesh, each with another of its arrays in the chunks, and the one that is being opened.
class ArrayStores {
 public:
  using Open = decltype(ServedColours::open);

  ArrayStores(std::shared_ptr<const MeshStore> first, const std::string& array, Open open)
      : first_(array), open_array_(std::move(open)) {
    open_[array] = std::move(first);
  }
  /// Replaces all stores.
  void reset(std::shared_ptr<const MeshStore> first) {
    open_.clear();
    open_[first_] = std::move(first);
  }

  /// Null: the array's store is not open.
  std::shared_ptr<const MeshStore> find(const std::string& array) const;
  /// Opens the array's store as soon as no other one is being opened; only the array wanted last waits.
  void want(const std::string& array);

  /// Result of opening a store; returned once.
  struct Opened {
    std::string array;
    Status status;
  };
  std::optional<Opened> take_opened();

 private:
  void begin(const std::string& array);

  static constexpr size_t kKept = 4;  // including the first one

  std::map<std::string, std::shared_ptr<const MeshStore>> open_;
  const std::string first_;
  Open open_array_;
  StoreOpening opening_;
  std::string opening_array_;
  std::optional<std::string> next_;
};

std::shared_ptr<const MeshStore> ArrayStores::find(const std::string& array) const {
  const auto found = open_.find(array);
  return found == open_.end() ? nullptr : found->second;
}

void ArrayStores::begin(const std::string& array) {
  opening_array_ = array;
  opening_.begin([this, array](const Progress& progress) { return open_array_(array, progress); });
}

void ArrayStores::want(const std::string& array) {
  if (find(array)) return;
  if (!opening_.running())
    begin(array);
  else if (opening_array_ != array)
    next_ = array;
  else
    next_.reset();
}

std::optional<ArrayStores::Opened> ArrayStores::take_opened() {
  auto made = opening_.take();
  if (!made) return std::nullopt;
  Opened out{opening_array_, made->ok() ? ok_status() : Status(made->error())};
  if (made->ok()) {
    for (auto old = open_.begin(); open_.size() >= kKept && old != open_.end();)
      old = old->first == first_ ? std::next(old) : open_.erase(old);
    open_[opening_array_] = **std::move(made);
  }
  if (next_) begin(*std::exchange(next_, std::nullopt));
  return out;
}

// A store that stands in for the whole one until that is made. Requests of earlier epochs are answered from it.
class ProvisionalStore {
 public:
  explicit ProvisionalStore(OpenStore whole) : shown_(whole != nullptr) {
    if (whole) opening_.begin(std::move(whole));
  }
  /// True until the whole store takes its place.
  bool shown() const { return shown_; }
  double fraction() const { return opening_.fraction(); }
  std::optional<StoreOpening::Made> take() { return opening_.take(); }
  void replace(std::shared_ptr<const MeshStore> before, const std::string& content_hash) {
    shown_ = false;
    before_ = std::move(before), content_hash_ = content_hash;
  }
  /// The session's first epoch with the whole store begins.
  void follow(const scene::SessionView& view, EpochId epoch) {
    if (before_ && !since_ && view.fact("content_hash") == content_hash_) since_ = epoch;
  }
  /// Returns the store for a request of an epoch; null: the whole one.
  std::shared_ptr<const MeshStore> find(EpochId epoch) const {
    return before_ && (!since_ || epoch.value < since_->value) ? before_ : nullptr;
  }

 private:
  StoreOpening opening_;
  bool shown_;
  std::shared_ptr<const MeshStore> before_;
  std::string content_hash_;
  std::optional<EpochId> since_;
};

// Answers queued per peer: samplers ask for as many chunks at a time as fill their link, and for a list.
constexpr int kAnswersWaiting = 16;
constexpr double kListsAtOnce = 4, kLists_s = 1;  // per peer: lists at once, then lists per second
constexpr size_t kPeers = 1024;                   // peers whose lists are counted

// Lists are large and cheap to ask for: each peer gets a few at once, then one per second.
class ListLimit {
 public:
  bool allow(const std::string& peer, double now_s) {
    if (peers_.size() >= kPeers && !peers_.contains(peer))
      std::erase_if(peers_, [&](const auto& p) { return now_s - p.second.at_s > kListsAtOnce / kLists_s; });
    if (peers_.size() >= kPeers && !peers_.contains(peer)) return false;
    Left& left = peers_.try_emplace(peer, Left{kListsAtOnce, now_s}).first->second;
    left.lists = std::min(kListsAtOnce, left.lists + (now_s - left.at_s) * kLists_s);
    left.at_s = now_s;
    if (left.lists < 1) return false;
    left.lists -= 1;
    return true;
  }

 private:
  struct Left {
    double lists, at_s;
  };
  std::map<std::string, Left> peers_;
};

class ServedMesh final : public Served {
 public:
  ServedMesh(std::shared_ptr<const MeshStore> store, std::string title, ServedColours colours, OpenStore whole)
      : store_(std::move(store)),
        title_(std::move(title)),
        as_begun_(std::move(colours.as_begun)),
        map_(std::move(colours.map)),
        iso_(colours.iso),
        stores_(store_, first_array(), std::move(colours.open)),
        provisional_(std::move(whole)) {}

  scene::Kind kind() const override { return scene::Kind::kMesh; }
  std::string title() const override { return title_; }
  std::string summary() const override {
    const MeshStoreInfo& info = store_->info();
    return fmt::format(
               "{} triangles in {} chunks{}{}", info.triangles, store_->leaves().size(),
               info.degenerate_dropped ? fmt::format(", {} degenerate ones dropped", info.degenerate_dropped) : "",
               info.from_cache ? " (from the chunk store)" : "") +
           (as_begun_ ? ", coloured by " + as_begun_->array : "");
  }
  std::vector<std::string> notes() const override {
    std::vector<std::string> out = store_->info().notes;
    if (provisional_.shown())
      out.push_back(title_ + ": is shown coarsely, from a part of its triangles, until its chunk store is made");
    if (!as_begun_ && map_.name != "viridis")
      out.push_back("--colour-map " + map_.name +
                    " shows nothing until an array is chosen: --colour-by, or ctl colour");
    return out;
  }
  void describe(wire::Hello& hello) const override {
    const MeshStoreInfo& info = store_->info();
    hello.facts.insert({{"format", info.format},
                        {"primitives", std::to_string(info.triangles)},
                        {"triangles", std::to_string(info.triangles)},
                        {"vertices", std::to_string(info.vertices)},
                        {"degenerate_dropped", std::to_string(info.degenerate_dropped)},
                        {"up", info.up},
                        {"from_cache", info.from_cache ? "true" : "false"},
                        {"content_hash", hash_text()}});
    if (iso_) {
      hello.facts[scene::kIsoFact] = fmt::format("{}", *iso_);
      if (!info.arrays.empty() && !info.arrays[0].spans.empty())
        hello.facts[scene::kIsoFact] += fmt::format(" {} {}", info.arrays[0].spans[0].lo, info.arrays[0].spans[0].hi);
      if (!info.arrays.empty() && !info.arrays[0].histogram.empty())
        hello.facts[volume::kHistogramFact] = info.arrays[0].histogram;
    } else if (!info.arrays.empty()) {
      hello.facts[scene::kArraysFact] = scene::to_text(info.arrays);
    }
    if (as_begun_) hello.facts[scene::kColouringFact] = scene::to_text(*as_begun_);
    hello.facts[scene::kColourMapFact] = colour::to_text(map_);
    if (const auto rotation = rotation_for_up(info.up, info.coordinates.space); rotation && !info.box_data.empty())
      hello.facts[scene::kPlacementFact] = scene::to_text(placement_of(*rotation));
    hello.box_room = info.box_room;
  }
  Requests requests() const override { return {"chunks", kAnswersWaiting}; }

  // The session may want other colours than it began with: by order of the master, or because an earlier data server
  // had them.
  Status follow(const wire::Welcome& session) override {
    epochs_.keep(session);
    const scene::SessionView view(session);
    provisional_.follow(view, session.epoch);
    const std::string order = view.fact(scene::kArrayOrderFact);
    if (std::exchange(master_, session.master) != session.master) order_.clear();  // another master counts from 1 again
    if (!order.empty() && order != order_) {
      order_ = order;
      if (provisional_.shown() && !stores_.find(ordered_array())) {
        answer_ = order_number() + " its chunk store is being made";
        return ok_status();
      }
      stores_.want(ordered_array());
      if (stores_.find(ordered_array())) answer_ = order_number();
    } else if (const std::string text = view.fact(scene::kColouringFact); text != shown_) {
      shown_ = text;
      const auto colouring =
          text.empty() ? Result<scene::Colouring>(scene::Colouring{}) : scene::colouring_from_text(text);
      if (!colouring) return colouring.error();
      stores_.want(colouring->array);
    }
    return ok_status();
  }

  // Samplers and packers repeat requests: for what is not made yet, and for answers that found the queue full.
  void answer(const net::Message& message, const Outlets& outlets) override {
    using namespace wire;
    net::dispatch<ChunkListRequest, ChunkRequest>(outlets.requests, message, [&](const auto& request) {
      constexpr bool kAsksForOne = std::is_same_v<std::decay_t<decltype(request)>, ChunkRequest>;
      if (!kAsksForOne && !lists_.allow(message.peer, monotonic_s())) return;
      const auto earlier = request.array == first_array() ? provisional_.find(request.epoch) : nullptr;
      const auto store = earlier ? earlier : stores_.find(request.array);
      if (!store) return;
      using Reply = decltype(reply(request, *store));
      outlets.requests.send_made<Reply>(message.peer, bytes_of(request, *store),
                                        [&] { return reply(request, *store); });
    });
  }
  Result<std::optional<std::string>> carry_out(const wire::Order& order) override {
    if (order.command != "probe") return Served::carry_out(order);
    const auto probe = scene::probe_from(order.arguments);
    if (!probe) return probe.error();
    const Epochs::Scene* shown = epochs_.find(probe->epoch);
    if (!shown) return Error{"probe: that epoch is over"};
    scene::Colouring colouring;
    if (!shown->colouring.empty()) {
      auto read = scene::colouring_from_text(shown->colouring);
      if (!read) return read.error();
      colouring = *std::move(read);
    }
    const auto store = stores_.find(colouring.array);
    if (!store) return Error{fmt::format("probe: the array {} is being read", colouring.array)};
    const auto choice = scene::choose_array(store->info().arrays, colouring.array);
    const bool of_cells = !colouring.array.empty() && choice && store->info().arrays[choice->index].of_cells;
    auto found = cast(*store, *probe, shown->clip, colouring.origin, of_cells);
    if (!found) return Error{"probe: no triangle lies there"};
    if (!colouring.array.empty()) found->array = colouring.array, found->array_unit = colouring.unit;
    return std::optional(scene::to_text(*found));
  }
  void send_finished(const Outlets&) override {
    if (auto whole = provisional_.take()) take_whole(*std::move(whole));
    const auto opened = stores_.take_opened();
    if (!opened) return;
    if (!opened->status) log::error("{}", opened->status.error().text);
    if (order_.empty() || opened->array != ordered_array()) return;
    answer_ = order_number();
    if (!opened->status) answer_ += " " + opened->status.error().text;
  }
  bool take_changed() override { return std::exchange(changed_, false); }
  Status failure() const override { return failure_; }
  void add_status(std::map<std::string, double>& values) const override {
    if (provisional_.shown()) values["store_made"] = provisional_.fraction();
  }
  std::map<std::string, std::string> news() override {
    if (answer_.empty()) return {};
    return {{scene::kArrayAnswerFact, std::exchange(answer_, std::string())}};
  }

 private:
  void take_whole(StoreOpening::Made whole) {
    if (!whole) return void(failure_ = whole.error());
    const auto before = std::exchange(store_, *std::move(whole));
    stores_.reset(store_);
    provisional_.replace(before, hash_text());
    log::info("the whole mesh is there: {}", summary());
    changed_ = true;
  }
  std::string first_array() const { return as_begun_ ? as_begun_->array : ""; }
  std::string hash_text() const { return fmt::format("{:016x}", store_->info().content_hash); }
  static wire::ChunkList reply(const wire::ChunkListRequest& request, const MeshStore& store) {
    return {request.epoch, store.chunks()};
  }
  // No bytes: the chunk does not exist.
  static wire::Chunk reply(const wire::ChunkRequest& request, const MeshStore& store) {
    const bool exists = request.chunk.value < store.chunks().size();
    return {request.epoch, request.chunk, exists ? store.chunk(request.chunk).bytes : wire::Bytes{}};
  }
  static uint64_t bytes_of(const wire::ChunkListRequest&, const MeshStore& store) {
    return store.chunks().size() * sizeof(geometry::ChunkInfo);
  }
  static uint64_t bytes_of(const wire::ChunkRequest& request, const MeshStore& store) {
    return request.chunk.value < store.chunks().size() ? store.chunks()[request.chunk.value].bytes : 0;
  }
  scene::Placement placement_of(const glm::dmat3& rotation) const {
    const MeshStoreInfo& info = store_->info();
    auto out = scene::placement_of(rotation, info.box_data, info.box_room, info.coordinates);
    const scene::Space space = info.coordinates.space;
    const bool metres =
        space == scene::Space::kGeographic || space == scene::Space::kProjected || info.format == "gltf";
    out.unit = metres ? "m" : info.coordinates.unit;
    return out;
  }
  // Parts of the order "N ARRAY".
  std::string order_number() const { return order_.substr(0, order_.find(' ')); }
  std::string ordered_array() const {
    const size_t blank = order_.find(' ');
    return blank == order_.npos ? "" : order_.substr(blank + 1);
  }

  std::shared_ptr<const MeshStore> store_;
  const std::string title_;
  const std::optional<scene::Colouring> as_begun_;
  const colour::ColourMap map_;
  const std::optional<double> iso_;
  ArrayStores stores_;
  ProvisionalStore provisional_;
  bool changed_ = false;
  Status failure_ = ok_status();
  ListLimit lists_;
  Epochs epochs_;
  InstanceId master_;
  std::string order_, shown_, answer_;
};

}  // namespace

std::unique_ptr<Served> serve_mesh(std::shared_ptr<const MeshStore> store, const std::string& path,
                                   ServedColours colours, OpenStore whole) {
  return std::make_unique<ServedMesh>(std::move(store), std::filesystem::path(path).filename().string(),
                                      std::move(colours), std::move(whole));
}

}  // namespace telesplat::data
