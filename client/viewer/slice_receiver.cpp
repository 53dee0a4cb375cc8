#include "client/viewer/slice_receiver.h"

#include <fmt/format.h>

#include <algorithm>

#include "common/core/clock.h"
#include "common/net/dispatch.h"
#include "common/volume/session.h"

namespace telesplat::viewer {
namespace {

constexpr double kIntroductionPeriod_s = 1;

// Of the image that the blocks will make: the smallest rectangle that holds them.
uint64_t pixels_of(const volume::EncodedSlice& slice) {
  if (slice.blocks.empty()) return 0;
  int x0 = slice.blocks[0].x, x1 = x0, y0 = slice.blocks[0].y, y1 = y0;
  for (const auto& b : slice.blocks)
    x0 = std::min(x0, b.x), x1 = std::max(x1, b.x), y0 = std::min(y0, b.y), y1 = std::max(y1, b.y);
  return uint64_t(x1 - x0 + 1) * uint64_t(y1 - y0 + 1) * volume::kSliceBlock * volume::kSliceBlock;
}

}  // namespace

SliceReceiver::SliceReceiver(const Options& options, Links links, SliceCache& cache, metrics::SpanRecorder& spans)
    : options_(options), links_(std::move(links)), cache_(cache), spans_(spans) {}

Status SliceReceiver::set_session(const wire::Welcome& session) {
  const auto read = volume::read_session(session.parameters, session.facts);
  if (!read) return read.error();
  if (const Status s = volume::validate(read->grid); !s) return s;
  grid_ = read->grid;
  return ok_status();
}

Result<BufferedFrame> SliceReceiver::decode(const wire::SliceFrame& f, const volume::Grid& grid) {
  if (const Status s = geometry::validate(f.camera); !s) return s.error();
  if (const Status s = volume::validate(f.shear, grid); !s) return s.error();
  const std::span bytes(reinterpret_cast<const uint8_t*>(f.data.data()), f.data.size());
  const auto slices = volume::parse_slices(bytes, f.shear.width, f.shear.height, int(f.shear.layers.size()));
  if (!slices) return slices.error();
  uint64_t pixels = 0;
  for (const auto& slice : *slices) pixels += pixels_of(slice);
  if (pixels > kMaxPixels) return Error{fmt::format("its images have {} pixels; at most {}", pixels, kMaxPixels)};
  auto out = std::make_shared<volume::VolumeFrame>();
  out->grid = grid;
  out->shear = f.shear;
  out->frame = f.frame;
  out->epoch = f.epoch;
  out->bytes = f.data.size();
  BufferedFrame buffered;
  for (const auto& slice : *slices) {
    auto image = volume::decode_slice(slice, f.shear.width, f.shear.height);
    if (!image) return image.error();
    out->images.push_back(std::move(*image));
  }
  for (const auto& image : out->images) buffered.pixels += image.pixels.size();
  buffered.update = {f.request, f.leased_s, f.camera.pose};
  buffered.frame = std::move(out);
  return buffered;
}

void SliceReceiver::receive(net::Socket& state, int most) {
  for (int n = 0; n < most; ++n) {
    const auto message = state.receive();
    if (!message) return;
    net::dispatch<wire::SliceFrame>(state, *message, [&](const wire::SliceFrame& f) { on(f, state); });
  }
}

void SliceReceiver::on(const wire::SliceFrame& f, net::Socket& state) {
  const double begin_s = monotonic_s();
  known_ = true;
  // What is not put into a buffer has left it.
  const bool again = f.packer == packer_ && f.frame <= newest_;
  if (again || f.viewer != options_.viewer || !grid_ || (options_.buffers > 0 && !links_.expected(f.request)))
    return acknowledge(f.frame, state);
  auto frame = decode(f, *grid_);
  if (!frame) {
    ++decode_errors_;
    if (log_limit_.allow(begin_s)) log::warn("volume frame {}: {}: dropped", f.frame.value, frame.error().text);
    return acknowledge(f.frame, state);
  }
  packer_ = f.packer;
  newest_ = f.frame;
  if (epoch_.value != 0 && f.epoch != epoch_) links_.on_epoch();
  epoch_ = f.epoch;
  if (const auto requested_s = links_.requested_s(f.request)) frame->update.requested_s = *requested_s;
  const uint64_t pixels = frame->pixels;
  pixels_received_ += pixels;
  spans_.add("decode", links_.to_master_s(begin_s), links_.to_master_s(monotonic_s()), 1);
  cache_.put(std::move(*frame));
  if (options_.buffers == 0) acknowledge(f.frame, state);
  links_.on_part({f.viewer, f.request, f.epoch, f.frame, true, std::max<uint64_t>(f.slabs, 1), pixels, f.voxels,
                  f.data.size(), f.camera});
}

void SliceReceiver::acknowledge(FrameId frame, net::Socket& state) {
  const bool in_order = options_.buffers > 0;
  state.send(wire::SliceAck{options_.viewer, frame, in_order ? options_.buffers : kAsyncBuffers, in_order});
}

void SliceReceiver::tick(double now_s, net::Socket& state) {
  for (const FrameId frame : cache_.take_left()) acknowledge(frame, state);
  cache_.free_dropped();
  if (known_ || now_s - introduced_s_ < kIntroductionPeriod_s) return;
  introduced_s_ = now_s;
  acknowledge({}, state);
}

}  // namespace telesplat::viewer
