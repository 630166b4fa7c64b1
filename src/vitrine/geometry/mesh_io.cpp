#include "geometry/mesh_io.h"

#include "base/error.h"
#include "base/file.h"
#include "base/text.h"

#include <tiny_obj_loader.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <map>
#include <sstream>

namespace vitrine {
namespace {

[[noreturn]] void refuse(const std::filesystem::path& path, const std::string& expected,
                         const std::string& found) {
    throw InputError({path.string(), expected, found, ""});
}

struct PlyProperty {
    std::string name;
    std::string type;
    std::string count_type;  ///< not empty: a list
};

struct PlyElement {
    std::string name;
    std::size_t count = 0;
    std::vector<PlyProperty> properties;
};

std::size_t type_size(const std::string& type) {
    static const std::map<std::string, std::size_t> sizes = {
        {"char", 1},  {"uchar", 1},   {"int8", 1},   {"uint8", 1},  {"short", 2}, {"ushort", 2},
        {"int16", 2}, {"uint16", 2},  {"int", 4},    {"uint", 4},   {"int32", 4}, {"uint32", 4},
        {"float", 4}, {"float32", 4}, {"double", 8}, {"float64", 8}};
    const auto found = sizes.find(type);
    return found == sizes.end() ? 0 : found->second;
}

/// Reads values of either encoding from the body of a PLY file.
class PlyBody {
  public:
    PlyBody(const std::filesystem::path& path, std::string_view body, bool is_binary)
        : path_(path), body_(body), is_binary_(is_binary) {}

    std::size_t left() const { return body_.size() - at_; }

    double value(const std::string& type) {
        if (!is_binary_) return ascii_value();
        const std::size_t size = type_size(type);
        if (left() < size) refuse(path_, "a whole PLY", "the file ends early");
        const char* bytes = body_.data() + at_;
        at_ += size;
        const bool is_unsigned = type[0] == 'u';
        if (type == "float" || type == "float32") return read<float>(bytes);
        if (size == 8) return read<double>(bytes);
        if (size == 1) return is_unsigned ? read<std::uint8_t>(bytes) : read<std::int8_t>(bytes);
        if (size == 2) return is_unsigned ? read<std::uint16_t>(bytes) : read<std::int16_t>(bytes);
        return is_unsigned ? read<std::uint32_t>(bytes) : read<std::int32_t>(bytes);
    }

  private:
    template <typename T>
    static double read(const char* bytes) {
        T v;
        std::memcpy(&v, bytes, sizeof v);
        return static_cast<double>(v);
    }
    double ascii_value() {
        const std::size_t begin = body_.find_first_not_of(" \t\r\n", at_);
        if (begin == std::string_view::npos) refuse(path_, "a whole PLY", "the file ends early");
        const std::size_t end = std::min(body_.find_first_of(" \t\r\n", begin), body_.size());
        double v = 0;
        if (!parse_double(body_.substr(begin, end - begin), v)) {
            refuse(path_, "a number", "\"" + std::string(body_.substr(begin, end - begin)) + "\"");
        }
        at_ = end;
        return v;
    }

    const std::filesystem::path& path_;
    std::string_view body_;
    bool is_binary_;
    std::size_t at_ = 0;
};

float srgb_byte_to_linear(double code) {
    const double v = code / 255.0;
    return static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
}

void add_polygon(const std::filesystem::path& path, Mesh& mesh,
                 const std::vector<long long>& corners, std::size_t vertex_count) {
    for (const long long c : corners) {
        if (c < 0 || static_cast<std::size_t>(c) >= vertex_count) {
            refuse(path, fmt::format("vertex indices below {}", vertex_count),
                   fmt::format("{}", c));
        }
    }
    for (std::size_t k = 2; k < corners.size(); ++k) {
        mesh.triangles.emplace_back(static_cast<int>(corners[0]), static_cast<int>(corners[k - 1]),
                                    static_cast<int>(corners[k]));
    }
}

void read_vertices(PlyBody& body, const PlyElement& element, Mesh& mesh) {
    std::map<std::string, std::size_t> slot;
    for (std::size_t i = 0; i < element.properties.size(); ++i)
        slot[element.properties[i].name] = i;
    const auto has = [&](const char* name) { return slot.count(name) > 0; };
    const bool has_normals = has("nx") && has("ny") && has("nz");
    const bool has_colours = has("red") && has("green") && has("blue");
    const bool is_byte_colour = has_colours && type_size(element.properties[slot["red"]].type) == 1;
    const char* u_name = has("u") ? "u" : has("s") ? "s" : "texture_u";
    const char* v_name = has("v") ? "v" : has("t") ? "t" : "texture_v";
    const bool has_uv = has(u_name) && has(v_name);
    std::vector<double> row(element.properties.size());
    for (std::size_t i = 0; i < element.count; ++i) {
        for (std::size_t p = 0; p < row.size(); ++p)
            row[p] = body.value(element.properties[p].type);
        const auto get = [&](const char* name) { return row[slot[name]]; };
        mesh.vertices.emplace_back(get("x"), get("y"), get("z"));
        if (has_normals) mesh.normals.emplace_back(get("nx"), get("ny"), get("nz"));
        if (has_uv) mesh.uv.emplace_back(get(u_name), get(v_name));
        if (has_colours) {
            Rgb colour(get("red"), get("green"), get("blue"));
            if (is_byte_colour) {
                for (int c = 0; c < 3; ++c) colour[c] = srgb_byte_to_linear(colour[c]);
            }
            mesh.colours.push_back(colour);
        }
    }
}

void check_finite(const std::filesystem::path& path, const Mesh& mesh) {
    for (const Vec3f& v : mesh.vertices) {
        if (!v.allFinite()) refuse(path, "finite vertex positions", "NaN or infinity");
    }
}

}  // namespace

Mesh read_ply(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    if (text.rfind("ply", 0) != 0) refuse(path, "a PLY file", "no \"ply\" in its first line");
    const std::size_t end = text.find("end_header");
    if (end == std::string::npos) refuse(path, "\"end_header\"", "none");
    const std::size_t body_at = text.find('\n', end);
    if (body_at == std::string::npos) refuse(path, "a whole PLY", "the file ends early");
    std::istringstream header(text.substr(0, end));
    std::string line, format;
    std::vector<PlyElement> elements;
    while (std::getline(header, line)) {
        const std::vector<std::string> words = split_whitespace(line);
        if (words.empty()) continue;
        if (words[0] == "format" && words.size() > 1) format = words[1];
        if (words[0] == "element" && words.size() == 3) {
            double count = -1;
            if (!parse_double(words[2], count) || count < 0 || count > 4e9) {
                refuse(path, "an element count", words[2]);
            }
            elements.push_back({words[1], static_cast<std::size_t>(count), {}});
        }
        if (words[0] == "property" && !elements.empty()) {
            PlyProperty property;
            if (words.size() == 5 && words[1] == "list") {
                property = {words[4], words[3], words[2]};
            } else if (words.size() == 3) {
                property = {words[2], words[1], ""};
            } else {
                refuse(path, "a property line", line);
            }
            if (type_size(property.type) == 0) refuse(path, "a known type", property.type);
            elements.back().properties.push_back(property);
        }
    }
    if (format != "binary_little_endian" && format != "ascii") {
        refuse(path, "format ascii or binary_little_endian", format.empty() ? "none" : format);
    }
    PlyBody body(path, std::string_view(text).substr(body_at + 1), format != "ascii");
    Mesh mesh;
    for (const PlyElement& element : elements) {
        // Every row takes at least one byte per property: a count beyond that is a lie.
        if (element.count * std::max<std::size_t>(1, element.properties.size()) > body.left()) {
            refuse(path, "as many " + element.name + " rows as the header says",
                   "a file too short for them");
        }
        if (element.name == "vertex") {
            for (const char* axis : {"x", "y", "z"}) {
                bool found = false;
                for (const PlyProperty& p : element.properties) found |= p.name == axis;
                if (!found) refuse(path, fmt::format("vertex property {}", axis), "none");
            }
            read_vertices(body, element, mesh);
            continue;
        }
        for (std::size_t i = 0; i < element.count; ++i) {
            for (const PlyProperty& property : element.properties) {
                if (property.count_type.empty()) {
                    body.value(property.type);
                    continue;
                }
                const double count = body.value(property.count_type);
                if (count < 0 || count > static_cast<double>(body.left())) {
                    refuse(path, "a plausible list length", fmt::format("{}", count));
                }
                std::vector<long long> list;
                for (int k = 0; k < count; ++k) {
                    list.push_back(static_cast<long long>(body.value(property.type)));
                }
                if (element.name == "face" &&
                    (property.name == "vertex_indices" || property.name == "vertex_index")) {
                    add_polygon(path, mesh, list, mesh.vertices.size());
                }
            }
        }
    }
    check_finite(path, mesh);
    return mesh;
}

Mesh read_obj(const std::filesystem::path& path) {
    const std::string text = read_text_file(path);
    tinyobj::ObjReaderConfig config;
    config.triangulate = false;
    config.vertex_color = false;
    tinyobj::ObjReader reader;
    if (!reader.ParseFromString(text, "", config)) {
        refuse(path, "a readable OBJ", reader.Error().empty() ? "damage" : reader.Error());
    }
    const tinyobj::attrib_t& attrib = reader.GetAttrib();
    const auto in_range = [&](int index, std::size_t values, int width) {
        return index >= 0 &&
               static_cast<std::size_t>(index) < values / static_cast<std::size_t>(width);
    };
    Mesh mesh;
    std::map<std::array<int, 3>, long long> seen;
    bool all_normals = true, all_uv = true;
    for (const tinyobj::shape_t& shape : reader.GetShapes()) {
        std::size_t at = 0;
        for (const auto corner_count : shape.mesh.num_face_vertices) {
            std::vector<long long> corners;
            for (std::size_t k = 0; k < corner_count; ++k, ++at) {
                const tinyobj::index_t index = shape.mesh.indices[at];
                if (!in_range(index.vertex_index, attrib.vertices.size(), 3) ||
                    (index.normal_index >= 0 &&
                     !in_range(index.normal_index, attrib.normals.size(), 3)) ||
                    (index.texcoord_index >= 0 &&
                     !in_range(index.texcoord_index, attrib.texcoords.size(), 2))) {
                    refuse(path, "indices within the file", fmt::format("face {}", at));
                }
                const auto [it, is_new] =
                    seen.try_emplace({index.vertex_index, index.normal_index, index.texcoord_index},
                                     static_cast<long long>(mesh.vertices.size()));
                if (is_new) {
                    const auto v = static_cast<std::size_t>(index.vertex_index) * 3;
                    mesh.vertices.emplace_back(attrib.vertices[v], attrib.vertices[v + 1],
                                               attrib.vertices[v + 2]);
                    all_normals &= index.normal_index >= 0;
                    all_uv &= index.texcoord_index >= 0;
                    const auto n = static_cast<std::size_t>(std::max(0, index.normal_index)) * 3;
                    mesh.normals.push_back(index.normal_index < 0
                                               ? Vec3f(0, 0, 1)
                                               : Vec3f(attrib.normals[n], attrib.normals[n + 1],
                                                       attrib.normals[n + 2]));
                    const auto t = static_cast<std::size_t>(std::max(0, index.texcoord_index)) * 2;
                    mesh.uv.push_back(index.texcoord_index < 0
                                          ? Vec2f(0, 0)
                                          : Vec2f(attrib.texcoords[t], attrib.texcoords[t + 1]));
                }
                corners.push_back(it->second);
            }
            add_polygon(path, mesh, corners, mesh.vertices.size());
        }
    }
    if (mesh.triangles.empty()) refuse(path, "at least one face", "none");
    if (!all_normals) mesh.normals.clear();
    if (!all_uv) mesh.uv.clear();
    check_finite(path, mesh);
    return mesh;
}

Mesh read_mesh(const std::filesystem::path& path) {
    const std::string extension = path.extension().string();
    if (extension == ".ply" || extension == ".PLY") return read_ply(path);
    if (extension == ".obj" || extension == ".OBJ") return read_obj(path);
    refuse(path, "a mesh in .ply or .obj format", extension.empty() ? "no extension" : extension);
}

void write_ply(const std::filesystem::path& path, const Mesh& mesh) {
    std::string data = "ply\nformat binary_little_endian 1.0\ncomment vitrine, metres\n";
    data += fmt::format("element vertex {}\n", mesh.vertices.size());
    data += "property float x\nproperty float y\nproperty float z\n";
    if (!mesh.normals.empty()) data += "property float nx\nproperty float ny\nproperty float nz\n";
    if (!mesh.uv.empty()) data += "property float u\nproperty float v\n";
    if (!mesh.colours.empty()) {
        data += "comment red green blue are linear\n";
        data += "property float red\nproperty float green\nproperty float blue\n";
    }
    data += fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n",
                        mesh.triangles.size());
    const auto put = [&](const auto& value) {
        data.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        for (int c = 0; c < 3; ++c) put(mesh.vertices[i][c]);
        if (!mesh.normals.empty()) {
            for (int c = 0; c < 3; ++c) put(mesh.normals[i][c]);
        }
        if (!mesh.uv.empty()) {
            for (int c = 0; c < 2; ++c) put(mesh.uv[i][c]);
        }
        if (!mesh.colours.empty()) {
            for (int c = 0; c < 3; ++c) put(mesh.colours[i][c]);
        }
    }
    for (const Triangle& t : mesh.triangles) {
        put(std::uint8_t{3});
        for (int k = 0; k < 3; ++k) put(static_cast<std::int32_t>(t[k]));
    }
    write_text_file(path, data);
}

}  // namespace vitrine
