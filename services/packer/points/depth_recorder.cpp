#include "services/packer/points/depth_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "common/codec/depth_codec.h"
#include "common/core/whole_file.h"

namespace telesplat::packer {
namespace {
constexpr size_t kMaxOpen = 4;  // frames that are composed at once
constexpr const char* kCameraColumns = "frame,width,height,px,py,pz,qw,qx,qy,qz,left,right,bottom,top,near_m";

std::string row_of(FrameId id, const geometry::Camera& c) {
  const auto& p = c.pose.position_room;
  const auto& q = c.pose.orientation;
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", id.value, c.width, c.height, p.x, p.y, p.z, q.w,
                     q.x, q.y, q.z, c.left, c.right, c.bottom, c.top, c.near_m);
}

}  // namespace

Result<DepthRecorder> DepthRecorder::open(const std::string& directory, int max_frames) {
  if (const auto error = make_private_folder(directory))
    return Error{fmt::format("{}: cannot be made a folder for depth images: {}", directory, error.message())};
  const std::string cameras = directory + "/cameras.csv";
  if (!(std::ofstream(cameras) << kCameraColumns << '\n')) return Error{fmt::format("{}: cannot be written", cameras)};
  DepthRecorder out;
  out.directory_ = directory;
  out.left_ = max_frames;
  return out;
}

Status DepthRecorder::add(FrameId id, const geometry::Camera& camera, const geometry::Rect& rect, size_t tiles_in_frame,
                          const image::DepthImage& tile) {
  if (left_ <= 0 || size_t(camera.width) * camera.height > codec::kMaxPixels) return ok_status();
  Frame& frame = open_.try_emplace(id, Frame{image::DepthImage(camera.width, camera.height)}).first->second;
  if (frame.image.width != camera.width || frame.image.height != camera.height) return ok_status();
  for (int y = 0; y < rect.height; ++y) {
    const auto from = size_t(y) * rect.width, to = size_t(rect.y + y) * camera.width + rect.x;
    std::copy_n(tile.depth.data() + from, rect.width, frame.image.depth.data() + to);
    std::copy_n(tile.colour.data() + from, rect.width, frame.image.colour.data() + to);
    std::copy_n(tile.normal.data() + from, rect.width, frame.image.normal.data() + to);
  }
  if (++frame.tiles < tiles_in_frame) {
    if (open_.size() > kMaxOpen) open_.erase(open_.begin());
    return ok_status();
  }
  const auto stream = codec::encode(frame.image);
  open_.erase(id);
  --left_;
  std::error_code ignored;
  const std::string path = fmt::format("{}/frame-{:06d}.depth", directory_, id.value);
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(stream.data()), std::streamsize(stream.size()));
  out.close();
  std::ofstream cameras;
  if (out) {
    cameras.open(directory_ + "/cameras.csv", std::ios::app);
    cameras << row_of(id, camera);
    cameras.close();
  }
  if (out && cameras) return ok_status();
  Error error{fmt::format("{}: cannot be written: {}", path, std::strerror(errno))};
  std::filesystem::remove(path, ignored);  // remove the incomplete file
  return error;
}

}  // namespace telesplat::packer
