# What the scripts in tools/ share: finding Rust, and installing the system packages that are missing.
#
# To be sourced by bash with `root` set to the repository. Nothing that is already there is touched: every need is first checked by what
# it provides (a command, a library, a driver), so that another compiler or a GPU's own driver also counts.

# Packages that are missing, by their names in Debian 12.
missing=()

say() { printf '%s\n' "$*" >&2; }

die() {
    say "$*"
    exit 1
}

has_command() { command -v "$1" >/dev/null 2>&1; }

has_library() {
    local list
    list=$(/sbin/ldconfig -p 2>/dev/null || ldconfig -p 2>/dev/null || true)
    [[ $list == *"$1"* ]]
}

# Whether one of the loader's folders holds a file of this name pattern.
has_manifest() {
    local folder
    for folder in "${XDG_DATA_HOME:-${HOME:-/}/.local/share}" /usr/local/share /usr/share /usr/local/etc /etc; do
        compgen -G "$folder/vulkan/$1" >/dev/null && return 0
    done
    return 1
}

has_driver() { [[ -n ${VK_DRIVER_FILES:-${VK_ICD_FILENAMES:-}} ]] || has_manifest 'icd.d/*.json'; }

has_validation_layer() { [[ -n ${VK_LAYER_PATH:-} ]] || has_manifest '*_layer.d/VkLayer_khronos_validation*.json'; }

# need PACKAGE CHECK...: notes the package when the check fails.
need() {
    local package=$1
    shift
    "$@" || missing+=("$package")
}

# What building and rendering take.
need_for_rendering() {
    need g++ has_command c++
    has_command cc || need gcc has_command gcc
    need libc6-dev compgen -G '/usr/include/stdlib.h' >/dev/null
    need glslc has_command "${GLSLC:-glslc}"
    need libvulkan1 has_library libvulkan.so.1
    need mesa-vulkan-drivers has_driver
}

# What the tests take beyond that: the validation layers, SPIR-V tools, and an X server without a screen for the viewer.
need_for_tests() {
    need_for_rendering
    need vulkan-validationlayers has_validation_layer
    need spirv-tools has_command spirv-val
    need xvfb has_command xvfb-run
    need xauth has_command xauth
    need libx11-6 has_library libX11.so.6
    need libx11-xcb1 has_library libX11-xcb.so.1
    need libxcursor1 has_library libXcursor.so.1
    need libxi6 has_library libXi.so.6
    need libxrandr2 has_library libXrandr.so.2
    need libxkbcommon0 has_library libxkbcommon.so.0
    need libxkbcommon-x11-0 has_library libxkbcommon-x11.so.0
}

# Installs what was noted as missing. Asks only on a terminal, and only once.
install_missing() {
    ((${#missing[@]})) || return 0
    if ! has_command apt-get || ! has_command dpkg; then
        say "Missing on this machine, by the names of Debian 12's packages: ${missing[*]}"
        die "Please install them, or what your distribution calls them, and run this again."
    fi
    local as_root=()
    if ((EUID != 0)); then
        has_command sudo || die "Missing packages: ${missing[*]}. Run as root: apt-get install --no-install-recommends ${missing[*]}"
        as_root=(sudo)
        [[ -t 0 ]] || as_root=(sudo -n)
    fi
    say "Installing what is missing with apt-get: ${missing[*]}"
    if [[ -t 0 && -t 2 ]]; then
        local answer
        read -r -p "Go on? [Y/n] " answer
        [[ -z $answer || $answer == [Yy]* ]] || die "Nothing was installed."
    fi
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get update -q >&2 </dev/null
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}" >&2 </dev/null
    missing=()
}

# Finds cargo, and says how to get it.
need_rust() {
    if ! has_command cargo && [[ -r ${CARGO_HOME:-${HOME:-}/.cargo}/env ]]; then
        # shellcheck disable=SC1091
        source "${CARGO_HOME:-${HOME:-}/.cargo}/env"
    fi
    local wanted have
    wanted=$(sed -n 's/^rust-version *= *"\(.*\)"/\1/p' "$root/Cargo.toml")
    if ! has_command cargo || ! has_command rustc; then
        die "Rust $wanted or newer is needed. Get it from https://rustup.rs, open a new shell and run this again."
    fi
    have=$(rustc --version | cut -d ' ' -f 2)
    if [[ $(printf '%s\n%s\n' "$wanted" "${have%%-*}" | sort -V | head -n 1) != "$wanted" ]]; then
        die "Rust $wanted or newer is needed, this is $have. With rustup: rustup update stable. Without: https://rustup.rs"
    fi
}

# need_rust_component COMMAND COMPONENT: a part of Rust that the minimal profile of rustup leaves out.
need_rust_component() {
    cargo "$1" --version >/dev/null 2>&1 && return 0
    has_command rustup || die "cargo $1 is needed: install Rust's component $2."
    say "Installing Rust's component $2 with rustup"
    rustup component add "$2" >&2
}

# The software driver compiles each kernel once and keeps it on disk: without a home folder it gets another place.
keep_shader_cache() {
    [[ -n ${MESA_SHADER_CACHE_DIR:-${XDG_CACHE_HOME:-}} || (-n ${HOME:-} && -w ${HOME:-}) ]] && return 0
    export MESA_SHADER_CACHE_DIR="$root/target/shader-cache"
    mkdir -p "$MESA_SHADER_CACHE_DIR"
}
