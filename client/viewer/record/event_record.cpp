#include "client/viewer/record/event_record.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstring>
#include <filesystem>

#include "common/codec/depth_codec.h"
#include "common/core/log.h"
#include "common/wire/serial.h"

namespace telesplat::viewer {
namespace {

constexpr char kMagic[8] = {'T', 'S', 'E', 'V', 'E', 'N', 'T', '2'};
constexpr std::string_view kReplica = "replica";
constexpr uint32_t kMaxType = 32;

struct RecordHead {
  uint32_t type_bytes = 0;
  uint64_t body_bytes = 0;
};

struct ReplicaBody {
  float lo[3], hi[3];
  uint32_t depth;
  uint32_t compact;
};
static_assert(sizeof(ReplicaBody) == 32);

}  // namespace

Result<std::unique_ptr<EventRecorder>> EventRecorder::open(const std::string& path, uint64_t max_bytes) {
  std::unique_ptr<EventRecorder> out(new EventRecorder);
  out->file_.reset(std::fopen(path.c_str(), "wb"));
  if (!out->file_ || std::fwrite(kMagic, 1, sizeof kMagic, out->file_.get()) != sizeof kMagic)
    return Error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  out->path_ = path;
  out->max_bytes_ = max_bytes;
  return out;
}

void EventRecorder::begin_replica(const points::ModelConfig& config) {
  const auto& b = config.box_room;
  const ReplicaBody body{
      {b.lo.x, b.lo.y, b.lo.z}, {b.hi.x, b.hi.y, b.hi.z}, static_cast<uint32_t>(config.depth), config.compact};
  write(kReplica, {reinterpret_cast<const char*>(&body), sizeof body});
}

void EventRecorder::add(const ModelEvent& event) {
  if (full_) return;
  std::visit([this](const auto& e) { write(std::decay_t<decltype(e)>::kName, wire::encode(e)); }, event.body);
}

void EventRecorder::write(std::string_view type, std::string_view body) {
  const uint64_t more = 12 + type.size() + body.size();
  if (full_) return;
  if (bytes_ + more > max_bytes_) {
    full_ = true;
    log::warn("{}: {} MiB of point-model events are recorded, the rest is left out", path_, max_bytes_ >> 20);
    return;
  }
  const auto type_bytes = static_cast<uint32_t>(type.size());
  const auto body_bytes = static_cast<uint64_t>(body.size());
  FILE* f = file_.get();
  const bool ok = std::fwrite(&type_bytes, 4, 1, f) == 1 && std::fwrite(&body_bytes, 8, 1, f) == 1 &&
                  std::fwrite(type.data(), 1, type.size(), f) == type.size() &&
                  std::fwrite(body.data(), 1, body.size(), f) == body.size();
  bytes_ += more;
  if (!ok) {
    full_ = true;
    log::warn("{}: cannot be written ({}); the rest is left out", path_, std::strerror(errno));
  }
}

void EventRecorder::flush() { std::fflush(file_.get()); }

struct EventReplay::Impl {
  std::string path;
  std::unique_ptr<FILE, int (*)(FILE*)> file{nullptr, std::fclose};
  uint64_t left = 0;  // bytes of the file not read yet
  std::unique_ptr<points::PointModel> model;
  Sequence applied;
  bool at_end = false;
  std::string type, body;
  bool pending = false;     // type and body hold an event that was read but not applied
  bool has_events = false;  // of the replica at hand
  image::DepthImage tile;

  // The next record; false at the end, also if it is cut off.
  bool read() {
    RecordHead head;
    if (std::fread(&head.type_bytes, 4, 1, file.get()) != 1 || std::fread(&head.body_bytes, 8, 1, file.get()) != 1)
      return false;
    left -= std::min<uint64_t>(left, 12);
    if (head.type_bytes > kMaxType || head.body_bytes > left || head.type_bytes + head.body_bytes > left) return false;
    type.resize(head.type_bytes);
    body.resize(head.body_bytes);
    left -= head.type_bytes + head.body_bytes;
    return std::fread(type.data(), 1, type.size(), file.get()) == type.size() &&
           std::fread(body.data(), 1, body.size(), file.get()) == body.size();
  }

  Error wrong(const std::string& what) const { return Error{fmt::format("{}: {}: {}", path, type, what)}; }

  Status begin_replica() {
    ReplicaBody b;
    if (body.size() != sizeof b) return wrong(fmt::format("{} bytes instead of {}", body.size(), sizeof b));
    std::memcpy(&b, body.data(), sizeof b);
    const points::ModelConfig config{{{b.lo[0], b.lo[1], b.lo[2]}, {b.hi[0], b.hi[1], b.hi[2]}},
                                     static_cast<int>(std::min<uint32_t>(b.depth, 1000)),
                                     b.compact != 0};
    if (const Status s = points::validate(config); !s) return wrong(s.error().text);
    model = std::make_unique<points::PointModel>(config);
    applied = {};
    has_events = false;
    return ok_status();
  }

  Status apply(const wire::Patch& p) {
    const std::span bytes(reinterpret_cast<const uint8_t*>(p.image.data()), p.image.size());
    if (const Status s = codec::decode_into(tile, bytes, p.rect.width, p.rect.height); !s) return wrong(s.error().text);
    model->insert(points::prepare_patch(model->config(), p.sequence, p.camera, p.rect, tile, p.frame));
    return ok_status();
  }
  Status apply(const wire::Forget& f) {
    if (f.frames.empty())
      model->forget(f.clusters);
    else
      model->forget(f.clusters, f.frames);
    return ok_status();
  }
  Status apply(const wire::EpochBegin&) {
    model->clear();
    return ok_status();
  }

  // Applies the pending event if it is not newer than `until`; false if it is.
  template <class E>
  Result<bool> apply_as(Sequence until) {
    const auto event = wire::decode<E>({reinterpret_cast<const std::byte*>(body.data()), body.size()});
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

EventReplay::EventReplay() : impl_(std::make_unique<Impl>()) {}
EventReplay::~EventReplay() = default;

Result<std::unique_ptr<EventReplay>> EventReplay::open(const std::string& path) {
  std::unique_ptr<EventReplay> out(new EventReplay);
  Impl& i = *out->impl_;
  i.path = path;
  i.file.reset(std::fopen(path.c_str(), "rb"));
  char magic[sizeof kMagic];
  std::error_code error;
  if (!i.file || std::fread(magic, 1, sizeof magic, i.file.get()) != sizeof magic ||
      std::memcmp(magic, kMagic, sizeof magic) != 0)
    return Error{fmt::format("{}: is not a record of point-model events", path)};
  i.left = std::filesystem::file_size(path, error) - sizeof magic;
  if (error) return Error{fmt::format("{}: {}", path, error.message())};
  return out;
}

Status EventReplay::advance(Sequence sequence) {
  Impl& i = *impl_;
  while (!i.at_end) {
    if (!i.pending && !i.read()) {
      i.at_end = true;
      break;
    }
    i.pending = true;
    Result<bool> applied = true;
    if (i.type == kReplica) {
      // Numbers begin again with another packer: what was asked for has been reached.
      if (i.model && i.applied >= sequence) return ok_status();
      if (const Status s = i.begin_replica(); !s) return s;
    } else if (i.type == wire::Patch::kName) {
      applied = i.apply_as<wire::Patch>(sequence);
    } else if (i.type == wire::Forget::kName) {
      applied = i.apply_as<wire::Forget>(sequence);
    } else if (i.type == wire::EpochBegin::kName) {
      applied = i.apply_as<wire::EpochBegin>(sequence);
    } else {
      return i.wrong("is no event");
    }
    if (!applied) return applied.error();
    if (i.type != kReplica) i.has_events = true;
    if (!*applied) return ok_status();
    i.pending = false;
  }
  return ok_status();
}

Status EventReplay::next_replica() {
  Impl& i = *impl_;
  while (!i.at_end) {
    if (!i.pending && !i.read()) {
      i.at_end = true;
      break;
    }
    i.pending = false;
    if (i.type != kReplica) {
      i.has_events = true;
      continue;
    }
    const bool follows = i.has_events;
    if (const Status s = i.begin_replica(); !s) return s;
    if (follows) return ok_status();
  }
  return Error{fmt::format("{}: holds no further replica", i.path)};
}

const points::PointModel* EventReplay::model() const { return impl_->model.get(); }
Sequence EventReplay::applied() const { return impl_->applied; }
bool EventReplay::at_end() const { return impl_->at_end; }

}  // namespace telesplat::viewer
