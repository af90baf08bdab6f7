# How a command runs on a driver that tools/drivers has unpacked: to be sourced by bash.

# on_driver FOLDER COMMAND...: with the driver of FOLDER/driver.json alone, and the libraries that came with it before the system's.
on_driver() {
    local folder=$1 path=${LD_LIBRARY_PATH:-}
    shift
    [[ ! -f $folder/libraries ]] || path=$folder/$(cat "$folder/libraries")${path:+:$path}
    VK_DRIVER_FILES=$folder/driver.json LD_LIBRARY_PATH=$path "$@"
}
