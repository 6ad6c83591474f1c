// What the C++ programs share: arguments and output as those of ../rust/src/main.rs.
//
// A library is a class with `static constexpr const char* name`, `static std::string version()`, a constructor from
// points, and `search(query, radius, state)`, which calls `state.add(squared distance)` for each point within
// the radius and honours `state.bound()`, the largest squared distance still of interest.
#pragma once

#include <sys/resource.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <limits>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

struct Point {
    float x, y, z;
};

inline float distance2(const Point& a, const Point& b) {
    float x = a.x - b.x, y = a.y - b.y, z = a.z - b.z;
    return x * x + y * y + z * z;
}

struct Found {
    uint32_t n = 0;
    float sum = 0;
};

// Sums 1 - d2 / r2.
class KernelSum {
public:
    explicit KernelSum(float radius) : radius2_(radius * radius), scale_(1 / radius2_) {}
    void clear() { found_ = {}; }
    void add(float d2) {
        found_.n++;
        found_.sum += 1 - d2 * scale_;
    }
    float bound() const { return radius2_; }
    Found result() const { return found_; }

private:
    float radius2_, scale_;
    Found found_;
};

// Keeps the k smallest squared distances up to the square of the radius, sorted.
class Nearest {
public:
    Nearest(float radius, size_t k)
        : list_(k), radius2_(std::min(radius * radius, std::numeric_limits<float>::max())) {}
    void clear() {
        std::fill(list_.begin(), list_.end(), std::numeric_limits<float>::infinity());
        n_ = 0;
    }
    void add(float d2) {
        if (!(d2 < list_.back())) return;
        size_t at = std::min(n_, list_.size() - 1);
        for (; at > 0 && d2 < list_[at - 1]; at--) list_[at] = list_[at - 1];
        list_[at] = d2;
        n_ = std::min(n_ + 1, list_.size());
    }
    float bound() const { return std::min(radius2_, list_.back()); }
    Found result() const {
        Found found;
        for (size_t i = 0; i < n_; i++) found.sum += list_[i];
        found.n = n_;
        return found;
    }

private:
    std::vector<float> list_;
    float radius2_;
    size_t n_ = 0;
};

inline double seconds(clockid_t clock) {
    timespec t;
    clock_gettime(clock, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

struct Spent {
    double cpu = 0, wall = 0;
};

template <class F>
Spent timed(F f) {
    double cpu = seconds(CLOCK_PROCESS_CPUTIME_ID), wall = seconds(CLOCK_MONOTONIC);
    f();
    return {seconds(CLOCK_PROCESS_CPUTIME_ID) - cpu, seconds(CLOCK_MONOTONIC) - wall};
}

// Bytes, of this process up to now.
inline double peak_memory() {
    std::ifstream status("/proc/self/status");
    for (std::string line; std::getline(status, line);) {
        if (line.rfind("VmHWM:", 0) == 0) return 1024.0 * std::atof(line.c_str() + 6);
    }
    throw std::runtime_error("no VmHWM");
}

inline std::vector<Point> read_points(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw std::runtime_error("cannot read " + path);
    std::vector<Point> points(size_t(file.tellg()) / sizeof(Point));
    file.seekg(0).read(reinterpret_cast<char*>(points.data()), std::streamsize(points.size() * sizeof(Point)));
    return points;
}

struct Case {
    std::string name;
    std::vector<Point> queries;
    float radius;
    size_t k;
};

inline Case read_case(const std::string& text, size_t limit) {
    std::stringstream fields(text);
    std::string name, path, radius, k;
    std::getline(fields, name, ',');
    std::getline(fields, path, ',');
    std::getline(fields, radius, ',');
    std::getline(fields, k, ',');
    Case c{name, read_points(path), strtof(radius.c_str(), nullptr), size_t(std::atoi(k.c_str()))};
    if (limit > 0 && limit < c.queries.size()) c.queries.resize(limit);
    return c;
}

template <class Library, class State>
std::vector<Found> ask(const Library& library, const Case& c, State state, size_t n) {
    std::vector<Found> found;
    found.reserve(n);
    for (size_t i = 0; i < n; i++) {
        state.clear();
        library.search(c.queries[i], c.radius, state);
        found.push_back(state.result());
    }
    return found;
}

template <class Library>
std::vector<Found> ask(const Library& library, const Case& c, size_t n) {
    return c.k == 0 ? ask(library, c, KernelSum(c.radius), n) : ask(library, c, Nearest(c.radius, c.k), n);
}

template <class Library>
int run(int argc, char** argv) {
    if (argc < 3) {
        std::fprintf(stderr, "LIMIT POINTS CASE...\n");
        return 2;
    }
    size_t limit = size_t(std::atoll(argv[1]));
    std::vector<Point> points = read_points(argv[2]);
    std::vector<Case> cases;
    for (int i = 3; i < argc; i++) cases.push_back(read_case(argv[i], limit));
    double before = peak_memory();
    std::unique_ptr<Library> library;
    Spent build;
    for (const Case& c : cases) {
        if (!library) build = timed([&] { library = std::make_unique<Library>(points); });
        size_t n = c.queries.size();
        ask(*library, c, std::min(n, n / 16 + 256));
        std::vector<Found> found;
        Spent search = timed([&] { found = ask(*library, c, n); });
        uint64_t neighbours = 0;
        double sum = 0;
        for (const Found& f : found) {
            neighbours += f.n;
            sum += f.sum;
        }
        std::printf(
            "{\"library\": \"%s\", \"version\": \"%s\", \"case\": \"%s\", \"build_ms\": %.6g, \"build_wall_ms\": %.6g, "
            "\"ns_per_query\": %.6g, \"wall_ns_per_query\": %.6g, \"queries\": %zu, \"neighbours\": %llu, "
            "\"sum\": %.17g, \"memory_mb\": %.6g}\n",
            Library::name, Library::version().c_str(), c.name.c_str(), 1e3 * build.cpu, 1e3 * build.wall,
            1e9 * search.cpu / double(n), 1e9 * search.wall / double(n), n, (unsigned long long)neighbours, sum,
            (peak_memory() - before) / 1e6);
        std::fflush(stdout);
    }
    return 0;
}
