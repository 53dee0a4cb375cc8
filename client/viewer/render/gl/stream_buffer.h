// Data that is written anew every frame, on its way to the GPU.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace telesplat::gl {

/// One buffer object in three parts, used in turns: the processor writes one while the GPU may still read the others.
/// Where the context has GL 4.4 (or ARB_buffer_storage) the buffer stays mapped, and writing is all there is to do;
/// otherwise data is gathered in memory and handed over by commit().
///
/// Each frame: begin(bytes), take() as often as needed, commit(), draw, end(). All calls need the context that made the
/// buffer.
class StreamBuffer {
 public:
  /// A place in the buffer. Write to data once, in order and without reading: it may be uncached memory.
  struct Slice {
    std::byte* data = nullptr;
    intptr_t offset = 0;  ///< in buffer(), a multiple of alignment()
    size_t bytes = 0;
  };

  /// persistent: asked for; what the context lacks is not used.
  explicit StreamBuffer(bool persistent = true);
  ~StreamBuffer();
  StreamBuffer(const StreamBuffer&) = delete;
  StreamBuffer& operator=(const StreamBuffer&) = delete;

  /// Makes room for slices of `bytes` in all, including padded(): waits until the GPU is done with what this part held
  /// three frames ago, or makes a larger buffer.
  void begin(size_t bytes);
  /// CHECKs that begin() made room.
  Slice take(size_t bytes);
  void commit();
  /// After the last command that reads this frame's slices.
  void end();

  /// `bytes` and what take() may add to them.
  size_t padded(size_t bytes) const { return (bytes + alignment_ - 1) / alignment_ * alignment_; }
  /// Whatever a storage or a uniform buffer's range may start at.
  size_t alignment() const { return alignment_; }
  uint32_t buffer() const { return buffer_; }
  bool persistent() const { return persistent_; }

 private:
  static constexpr int kParts = 3;
  void wait(int part);
  void reserve(size_t bytes);

  bool persistent_;
  size_t alignment_ = 256;
  uint32_t buffer_ = 0;
  std::byte* mapped_ = nullptr;
  std::vector<std::byte> gathered_;  // where nothing is mapped
  size_t part_bytes_ = 0, used_ = 0;
  int part_ = 0;
  std::array<void*, kParts> fences_{};  // GLsync: set while the GPU may read that part
};

}  // namespace telesplat::gl
