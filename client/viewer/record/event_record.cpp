#include "client/viewer/record/event_record.h"

#include <fmt/format.h>

#include <cstring>

#include "client/viewer/points/base_replica.h"
#include "client/viewer/points/event_sequencer.h"
#include "common/codec/depth_codec.h"
#include "common/refinement/bounded_patches.h"
#include "common/wire/serial.h"

namespace telesplat::viewer {
namespace {

constexpr std::string_view kMagic = "TSEVENT5", kBaseless = "TSEVENT4", kUnrefined = "TSEVENT3",
                           kWithoutSummaries = "TSEVENT2";
constexpr std::string_view kReplica = "replica", kSummary = "summary", kBaseChange = "base_change",
                           kBaseDrop = "base_drop";

struct ReplicaBody {
  float lo[3], hi[3];
  uint32_t depth;
  uint32_t compact;
};
static_assert(sizeof(ReplicaBody) == 32);

struct SummaryBody {
  uint64_t number;
  uint32_t brick;
  uint32_t unused;
};
static_assert(sizeof(SummaryBody) == 16);

template <class T>
std::string_view bytes_of(const T& body) {
  return {reinterpret_cast<const char*>(&body), sizeof body};
}

}  // namespace

Result<std::unique_ptr<EventRecorder>> EventRecorder::open(const std::string& path, uint64_t max_bytes) {
  auto file = RecordWriter::open(path, kMagic, max_bytes, "point-model events");
  if (!file) return file.error();
  return std::unique_ptr<EventRecorder>(new EventRecorder(std::move(*file)));
}

void EventRecorder::begin_replica(const points::ModelConfig& config) {
  const auto& b = config.box_room;
  file_.write(
      kReplica,
      bytes_of(ReplicaBody{
          {b.lo.x, b.lo.y, b.lo.z}, {b.hi.x, b.hi.y, b.hi.z}, static_cast<uint32_t>(config.depth), config.compact}));
}

void EventRecorder::add(const ModelEvent& event) {
  if (file_.full()) return;
  std::visit([this](const auto& e) { file_.write(std::decay_t<decltype(e)>::kName, wire::encode(e)); }, event.body);
}

void EventRecorder::add_summary(uint64_t number, points::ClusterKey brick) {
  file_.write(kSummary, bytes_of(SummaryBody{number, brick, 0}));
}

void EventRecorder::add(const wire::BasePart& part) {
  if (!file_.full()) file_.write(wire::BasePart::kName, wire::encode(part));
}

void EventRecorder::add(const wire::BaseBegin& begin) {
  if (!file_.full()) file_.write(wire::BaseBegin::kName, wire::encode(begin));
}

void EventRecorder::add(const wire::BaseHidden& hidden) {
  if (!file_.full()) file_.write(wire::BaseHidden::kName, wire::encode(hidden));
}

void EventRecorder::add(const wire::BaseTree& tree) {
  if (!file_.full()) file_.write(wire::BaseTree::kName, wire::encode(tree));
}

void EventRecorder::add_base_drop(uint32_t node) { file_.write(kBaseDrop, bytes_of(node)); }

void EventRecorder::add_base_change(uint64_t number) { file_.write(kBaseChange, bytes_of(number)); }

struct EventReplay::Impl {
  explicit Impl(RecordReader opened, bool with_summaries) : file(std::move(opened)), makes_summaries(with_summaries) {}

  RecordReader file;
  const bool makes_summaries;
  std::unique_ptr<points::PointModel> model;
  points::Summaries summaries;
  FineRays rays;
  Sequence applied;
  bool at_end = false;
  bool pending = false;     // a record was read and not applied yet
  bool has_events = false;  // the replica at hand has an event
  image::DepthImage tile;
  refinement::BoundedPatches bounded;
  BaseReplica base{[](const wire::BaseRequest&) {}};
  std::shared_ptr<const splat::BaseMesh> shown_base;

  const std::string& type() const { return file.type(); }
  const std::string& body() const { return file.body(); }
  Error wrong(const std::string& what) const { return file.wrong(what); }

  // Makes sure that there is a record; false at the end.
  bool have_record() {
    if (!pending && !file.next()) at_end = true;
    pending = !at_end;
    return pending;
  }

  Status begin_replica() {
    ReplicaBody b;
    if (body().size() != sizeof b) return wrong(fmt::format("{} bytes instead of {}", body().size(), sizeof b));
    std::memcpy(&b, body().data(), sizeof b);
    const points::ModelConfig config{{{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}},
                                     static_cast<int>(std::min<uint32_t>(b.depth, 1000)),
                                     b.compact != 0};
    if (const Status s = points::validate(config); !s) return wrong(s.error().text);
    model = std::make_unique<points::PointModel>(config);
    summaries.clear();
    rays.clear();
    bounded.clear();
    applied = {};
    has_events = false;
    return ok_status();
  }

  Status apply(const wire::Patch& p) {
    const std::span bytes(reinterpret_cast<const uint8_t*>(p.image.data()), p.image.size());
    if (const Status s = codec::decode_into(tile, bytes, p.rect.width, p.rect.height); !s) return wrong(s.error().text);
    if (const Status s = add_rays(p, tile, rays); !s) return wrong(s.error().text);
    if (p.refinable) bounded.add(p.sequence, p.camera, p.rect, bytes, tag_of(p));
    model->insert(points::prepare_patch(model->config(), p.sequence, p.camera, p.rect, tile, tag_of(p)));
    return ok_status();
  }
  Status apply(const wire::Forget& f) {
    if (f.frames.empty())
      model->forget(f.clusters);
    else
      model->forget(f.clusters, f.frames);
    for (const points::ClusterKey key : f.clusters)
      if (const auto brick = points::brick_key(key); !model->bricks().contains(brick)) summaries.erase(brick);
    return ok_status();
  }
  Status apply(const wire::Refine& r) {
    const std::span bytes(reinterpret_cast<const uint8_t*>(r.image.data()), r.image.size());
    const auto refinement = bounded.refine(model->config(), r.sequence, r.patch, bytes);
    if (!refinement) return wrong(refinement.error().text);
    if (*refinement) model->commit(points::plan_refinement(*model, **refinement));
    return ok_status();
  }
  Status apply(const wire::EpochBegin&) {
    bounded.clear();
    model->clear();
    summaries.clear();
    rays.clear();
    return ok_status();
  }

  // Makes the pending summary if its number is at most `until`; else returns false.
  Result<bool> apply_summary(uint64_t until) {
    SummaryBody b;
    if (body().size() != sizeof b) return wrong(fmt::format("{} bytes instead of {}", body().size(), sizeof b));
    std::memcpy(&b, body().data(), sizeof b);
    if (!model) return wrong("comes before any replica");
    if (b.number > until) return false;
    if (!makes_summaries) return true;
    const auto brick = model->bricks().find(b.brick);
    if (brick == model->bricks().end()) return wrong(fmt::format("brick {} holds no points", b.brick));
    summaries[b.brick] = points::summarise(*model, b.brick, *brick->second, applied);
    return true;
  }

  template <class M>
  Result<bool> take_base() {
    const auto message = wire::decode<M>({reinterpret_cast<const std::byte*>(body().data()), body().size()});
    if (!message) return wrong(message.error().text);
    if constexpr (std::is_same_v<M, wire::BasePart>) {
      if (const Status s = base.take(*message, 0); !s) return wrong(s.error().text);
    } else {
      base.take(*message, 0);
    }
    return true;
  }

  Result<bool> drop_base() {
    uint32_t node = 0;
    if (body().size() != sizeof node) return wrong(fmt::format("{} bytes instead of {}", body().size(), sizeof node));
    std::memcpy(&node, body().data(), sizeof node);
    base.drop(node);
    return true;
  }

  // Changes the base as the viewer did if the change's number is at most `until`; else returns false.
  Result<bool> change_base(uint64_t until) {
    uint64_t number = 0;
    if (body().size() != sizeof number)
      return wrong(fmt::format("{} bytes instead of {}", body().size(), sizeof number));
    std::memcpy(&number, body().data(), sizeof number);
    if (number > until) return false;
    shown_base = base.mesh();
    return true;
  }

  // Applies the pending event if it is not newer than `until`; else returns false.
  template <class E>
  Result<bool> apply_as(Sequence until) {
    const auto event = wire::decode<E>({reinterpret_cast<const std::byte*>(body().data()), body().size()});
    if (!event) return wrong(event.error().text);
    if (!model) return wrong("comes before any replica");
    if (event->sequence <= applied)
      return wrong(fmt::format("sequence {} does not follow {}", event->sequence.value, applied.value));
    if (event->sequence > until) return false;
    if (const Status s = apply(*event); !s) return s.error();
    applied = event->sequence;
    return true;
  }
};

EventReplay::EventReplay(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
EventReplay::~EventReplay() = default;

Result<std::unique_ptr<EventReplay>> EventReplay::open(const std::string& path, bool with_summaries) {
  auto file =
      RecordReader::open(path, {kMagic, kBaseless, kUnrefined, kWithoutSummaries}, "a record of point-model events");
  if (!file) return file.error();
  return std::unique_ptr<EventReplay>(new EventReplay(std::make_unique<Impl>(std::move(*file), with_summaries)));
}

Status EventReplay::advance(const Moment& moment) {
  Impl& i = *impl_;
  while (i.have_record()) {
    Result<bool> applied = true;
    if (i.type() == kReplica) {
      // Numbers begin again with another packer: the moment asked for has been reached.
      if (i.model && i.applied >= moment.sequence) return ok_status();
      if (const Status s = i.begin_replica(); !s) return s;
    } else if (i.type() == kSummary) {
      applied = i.apply_summary(moment.summaries);
    } else if (i.type() == kBaseChange) {
      applied = i.change_base(moment.summaries);
    } else if (i.type() == wire::BasePart::kName) {
      applied = i.take_base<wire::BasePart>();
    } else if (i.type() == kBaseDrop) {
      applied = i.drop_base();
    } else if (i.type() == wire::BaseTree::kName) {
      applied = i.take_base<wire::BaseTree>();
    } else if (i.type() == wire::BaseBegin::kName) {
      applied = i.take_base<wire::BaseBegin>();
    } else if (i.type() == wire::BaseHidden::kName) {
      applied = i.take_base<wire::BaseHidden>();
    } else if (i.type() == wire::Patch::kName) {
      applied = i.apply_as<wire::Patch>(moment.sequence);
    } else if (i.type() == wire::Forget::kName) {
      applied = i.apply_as<wire::Forget>(moment.sequence);
    } else if (i.type() == wire::Refine::kName) {
      applied = i.apply_as<wire::Refine>(moment.sequence);
    } else if (i.type() == wire::EpochBegin::kName) {
      applied = i.apply_as<wire::EpochBegin>(moment.sequence);
    } else {
      return i.wrong("is no event");
    }
    if (!applied) return applied.error();
    if (i.type() != kReplica && !i.type().starts_with("base_")) i.has_events = true;
    if (!*applied) return ok_status();
    i.pending = false;
  }
  return ok_status();
}

Status EventReplay::next_replica() {
  Impl& i = *impl_;
  while (i.have_record()) {
    i.pending = false;
    if (i.type() != kReplica) {
      i.has_events = true;
      continue;
    }
    const bool follows = i.has_events;
    if (const Status s = i.begin_replica(); !s) return s;
    if (follows) return ok_status();
  }
  return Error{fmt::format("{}: holds no further replica", i.file.path())};
}

const points::PointModel* EventReplay::model() const { return impl_->model.get(); }
const points::Summaries& EventReplay::summaries() const { return impl_->summaries; }
std::shared_ptr<const splat::BaseMesh> EventReplay::base() const { return impl_->shown_base; }
Sequence EventReplay::applied() const { return impl_->applied; }
const FineRays& EventReplay::fine_rays() const { return impl_->rays; }
bool EventReplay::at_end() const { return impl_->at_end; }

}  // namespace telesplat::viewer
