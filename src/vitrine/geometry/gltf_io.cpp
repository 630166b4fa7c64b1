#include "geometry/gltf_io.h"

#include "base/error.h"
#include "base/file.h"

#include <tiny_gltf.h>

#include <cmath>
#include <cstring>

namespace vitrine {
namespace fs = std::filesystem;
namespace {

constexpr int kMaxNodeDepth = 64;  // deeper is a cycle or an attack

[[noreturn]] void refuse(const fs::path& path, const std::string& expected,
                         const std::string& found) {
    throw InputError({path.string(), expected, found, ""});
}

/// Pictures are left out; tinygltf insists on a loader for embedded ones.
bool skip_image(tinygltf::Image*, const int, std::string*, std::string*, int, int,
                const unsigned char*, int, void*) {
    return true;
}

/// A typed view of an accessor that checks its range once.
class Accessor {
  public:
    Accessor(const fs::path& path, const tinygltf::Model& model, int index) : path_(path) {
        if (index < 0 || static_cast<std::size_t>(index) >= model.accessors.size()) {
            refuse(path, "an accessor of the file", fmt::format("index {}", index));
        }
        const tinygltf::Accessor& accessor = model.accessors[static_cast<std::size_t>(index)];
        if (accessor.sparse.isSparse || accessor.bufferView < 0 ||
            static_cast<std::size_t>(accessor.bufferView) >= model.bufferViews.size()) {
            refuse(path, "accessors with a buffer view", "a sparse or empty one");
        }
        const tinygltf::BufferView& view =
            model.bufferViews[static_cast<std::size_t>(accessor.bufferView)];
        if (view.buffer < 0 || static_cast<std::size_t>(view.buffer) >= model.buffers.size()) {
            refuse(path, "a buffer of the file", fmt::format("index {}", view.buffer));
        }
        const std::vector<unsigned char>& data =
            model.buffers[static_cast<std::size_t>(view.buffer)].data;
        type_ = accessor.componentType;
        count_ = accessor.count;
        width_ = tinygltf::GetNumComponentsInType(static_cast<uint32_t>(accessor.type));
        const int size = tinygltf::GetComponentSizeInBytes(static_cast<uint32_t>(type_));
        const int stride = accessor.ByteStride(view);
        if (width_ < 1 || size < 1 || stride < width_ * size)
            refuse(path, "a known layout", "another");
        stride_ = static_cast<std::size_t>(stride);
        const std::size_t offset = view.byteOffset + accessor.byteOffset;
        const std::size_t element = static_cast<std::size_t>(width_ * size);
        // Divide rather than multiply: counts come from the file and may be huge.
        if (offset > data.size() || view.byteLength > data.size() ||
            (count_ > 0 && (data.size() - offset < element ||
                            (data.size() - offset - element) / stride_ < count_ - 1))) {
            refuse(path, "accessors within their buffer", "one that ends beyond it");
        }
        data_ = data.data() + offset;
    }

    std::size_t count() const { return count_; }
    int width() const { return width_; }

    double value(std::size_t i, int component) const {
        const unsigned char* at = data_ + i * stride_;
        switch (type_) {
            case TINYGLTF_COMPONENT_TYPE_FLOAT:
                return read<float>(at, component);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT:
                return read<std::uint32_t>(at, component);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT:
                return read<std::uint16_t>(at, component);
            case TINYGLTF_COMPONENT_TYPE_UNSIGNED_BYTE:
                return read<std::uint8_t>(at, component);
            default:
                refuse(path_, "float or unsigned components", fmt::format("type {}", type_));
        }
    }
    Vec3f vec3(std::size_t i) const {
        return {static_cast<float>(value(i, 0)), static_cast<float>(value(i, 1)),
                static_cast<float>(value(i, 2))};
    }

  private:
    template <typename T>
    static double read(const unsigned char* at, int component) {
        T v;
        std::memcpy(&v, at + static_cast<std::size_t>(component) * sizeof v, sizeof v);
        return static_cast<double>(v);
    }

    const fs::path& path_;
    const unsigned char* data_ = nullptr;
    std::size_t stride_ = 0, count_ = 0;
    int type_ = 0, width_ = 0;
};

Mat4 node_matrix(const tinygltf::Node& node) {
    Mat4 m = Mat4::Identity();
    if (node.matrix.size() == 16) {  // column-major
        for (int i = 0; i < 16; ++i) m(i % 4, i / 4) = node.matrix[static_cast<std::size_t>(i)];
        return m;
    }
    if (node.rotation.size() == 4) {
        m.topLeftCorner<3, 3>() = Eigen::Quaterniond(node.rotation[3], node.rotation[0],
                                                     node.rotation[1], node.rotation[2])
                                      .normalized()
                                      .toRotationMatrix();
    }
    if (node.scale.size() == 3) {
        for (int c = 0; c < 3; ++c) m.col(c) *= node.scale[static_cast<std::size_t>(c)];
    }
    if (node.translation.size() == 3) {
        for (int c = 0; c < 3; ++c) m(c, 3) = node.translation[static_cast<std::size_t>(c)];
    }
    return m;
}

double extension_number(const tinygltf::Value& extension, const char* key, double fallback) {
    if (!extension.IsObject() || !extension.Has(key)) return fallback;
    const tinygltf::Value& value = extension.Get(key);
    return value.IsNumber() ? value.GetNumberAsDouble() : fallback;
}

GltfMaterial read_material(const tinygltf::Model& model, int index) {
    GltfMaterial result;
    if (index < 0 || static_cast<std::size_t>(index) >= model.materials.size()) {
        result.base_colour = Rgb::Constant(0.7f);  // no material at all: plain matte
        result.metallic = 0.0;
        return result;
    }
    const tinygltf::Material& material = model.materials[static_cast<std::size_t>(index)];
    const tinygltf::PbrMetallicRoughness& pbr = material.pbrMetallicRoughness;
    result.name = material.name;
    if (pbr.baseColorFactor.size() >= 3) {
        for (int c = 0; c < 3; ++c) {
            result.base_colour[c] =
                static_cast<float>(pbr.baseColorFactor[static_cast<std::size_t>(c)]);
        }
    }
    result.metallic = pbr.metallicFactor;
    result.roughness = pbr.roughnessFactor;
    result.has_texture = pbr.baseColorTexture.index >= 0;
    for (const auto& [name, extension] : material.extensions) {
        if (name == "KHR_materials_ior") result.ior = extension_number(extension, "ior", 1.5);
        if (name == "KHR_materials_transmission") {
            result.transmission = extension_number(extension, "transmissionFactor", 0.0);
        }
        if (name == "KHR_materials_volume") {
            const double distance = extension_number(extension, "attenuationDistance", 0.0);
            if (distance > 0 && extension.Has("attenuationColor") &&
                extension.Get("attenuationColor").ArrayLen() == 3) {
                for (int c = 0; c < 3; ++c) {
                    const double colour =
                        extension.Get("attenuationColor").Get(c).GetNumberAsDouble();
                    result.sigma_a_per_m[c] =
                        static_cast<float>(-std::log(std::clamp(colour, 1e-6, 1.0)) / distance);
                }
            }
        }
    }
    return result;
}

Mesh read_primitive(const fs::path& path, const tinygltf::Model& model,
                    const tinygltf::Primitive& primitive) {
    Mesh mesh;
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) refuse(path, "POSITION of each primitive", "none");
    const Accessor points(path, model, position->second);
    if (points.width() != 3) refuse(path, "positions of three numbers", "another width");
    for (std::size_t i = 0; i < points.count(); ++i) {
        mesh.vertices.push_back(points.vec3(i));
        if (!mesh.vertices.back().allFinite()) refuse(path, "finite positions", "NaN or infinity");
    }
    const auto normal = primitive.attributes.find("NORMAL");
    if (normal != primitive.attributes.end()) {
        const Accessor normals(path, model, normal->second);
        if (normals.count() == points.count() && normals.width() == 3) {
            for (std::size_t i = 0; i < normals.count(); ++i)
                mesh.normals.push_back(normals.vec3(i));
        }
    }
    std::vector<std::size_t> order;
    if (primitive.indices >= 0) {
        const Accessor indices(path, model, primitive.indices);
        for (std::size_t i = 0; i < indices.count(); ++i) {
            const double index = indices.value(i, 0);
            if (index >= static_cast<double>(points.count())) {
                refuse(path, fmt::format("vertex indices below {}", points.count()),
                       fmt::format("{}", index));
            }
            order.push_back(static_cast<std::size_t>(index));
        }
    } else {
        for (std::size_t i = 0; i < points.count(); ++i) order.push_back(i);
    }
    for (std::size_t i = 0; i + 2 < order.size(); i += 3) {
        mesh.triangles.emplace_back(static_cast<int>(order[i]), static_cast<int>(order[i + 1]),
                                    static_cast<int>(order[i + 2]));
    }
    return mesh;
}

class Reader {
  public:
    Reader(const fs::path& path, const tinygltf::Model& model) : path_(path), model_(model) {}

    std::vector<GltfPrimitive> read() {
        Mat4 z_up = Mat4::Identity();
        z_up.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, -1, 0, 1, 0;
        const int scene = std::max(0, model_.defaultScene);
        if (static_cast<std::size_t>(scene) >= model_.scenes.size())
            refuse(path_, "a scene", "none");
        for (const int node : model_.scenes[static_cast<std::size_t>(scene)].nodes)
            visit(node, z_up, 0);
        if (result_.empty()) refuse(path_, "at least one triangle", "none");
        return std::move(result_);
    }

  private:
    void visit(int index, const Mat4& parent, int depth) {
        if (index < 0 || static_cast<std::size_t>(index) >= model_.nodes.size() ||
            depth > kMaxNodeDepth) {
            refuse(path_, "a tree of nodes", "a missing node or a cycle");
        }
        const tinygltf::Node& node = model_.nodes[static_cast<std::size_t>(index)];
        const Mat4 matrix = parent * node_matrix(node);
        if (node.mesh >= 0) {
            if (static_cast<std::size_t>(node.mesh) >= model_.meshes.size()) {
                refuse(path_, "a mesh of the file", fmt::format("index {}", node.mesh));
            }
            for (const tinygltf::Primitive& primitive :
                 model_.meshes[static_cast<std::size_t>(node.mesh)].primitives) {
                if (primitive.mode != TINYGLTF_MODE_TRIANGLES && primitive.mode != -1) continue;
                Mesh mesh = transformed(read_primitive(path_, model_, primitive), matrix);
                if (mesh.triangles.empty()) continue;
                result_.push_back(
                    {node.name, std::move(mesh), read_material(model_, primitive.material)});
            }
        }
        for (const int child : node.children) visit(child, matrix, depth + 1);
    }

    const fs::path& path_;
    const tinygltf::Model& model_;
    std::vector<GltfPrimitive> result_;
};

/// Buffers may lie beside the file, not elsewhere.
bool is_inside(const std::string& file, const fs::path& folder) {
    const fs::path relative = fs::path(file).lexically_normal().lexically_relative(folder);
    return !relative.empty() && *relative.begin() != "..";
}

struct FileGuard {
    fs::path folder;
    std::string refused;
};

bool guarded_exists(const std::string& file, void* data) {
    auto* guard = static_cast<FileGuard*>(data);
    if (!is_inside(file, guard->folder)) {
        guard->refused = file;
        return false;
    }
    return fs::is_regular_file(file);
}

}  // namespace

std::vector<GltfPrimitive> read_gltf(const fs::path& path) {
    const std::string bytes = read_text_file(path);
    const fs::path folder = fs::absolute(path).lexically_normal().parent_path();
    FileGuard guard{folder, ""};
    tinygltf::TinyGLTF loader;
    loader.SetImageLoader(skip_image, nullptr);
    loader.SetFsCallbacks({guarded_exists, tinygltf::ExpandFilePath, tinygltf::ReadWholeFile,
                           tinygltf::WriteWholeFile, &guard});
    tinygltf::Model model;
    std::string error, warning;
    const bool is_binary = bytes.rfind("glTF", 0) == 0;
    const auto size = static_cast<unsigned>(bytes.size());
    bool ok = false;
    try {
        ok = is_binary
                 ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                               reinterpret_cast<const unsigned char*>(bytes.data()),
                                               size, folder.string())
                 : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size,
                                              folder.string());
    } catch (const std::exception& thrown) {
        error = thrown.what();
    }
    if (!guard.refused.empty()) refuse(path, "files within its folder", guard.refused);
    if (!ok)
        refuse(path, "a readable glTF",
               error.empty() ? "damage" : error.substr(0, error.find('\n')));
    for (const std::string& extension : model.extensionsRequired) {
        if (extension != "KHR_materials_ior" && extension != "KHR_materials_transmission" &&
            extension != "KHR_materials_volume") {
            refuse(path, "no required extension that we do not know", extension);
        }
    }
    return Reader(path, model).read();
}

}  // namespace vitrine
