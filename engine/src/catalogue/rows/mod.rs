//! The rows, ordered by document, topic and id: one file a document, or a topic of it.

mod maps;
mod metals;
mod own;
mod photon_mapping;
mod visibility;

use super::Row;

const FILES: [&[Row]; 10] = {
    let [kernels, trees, photon_maps, photons, media, rendering] = photon_mapping::FILES;
    [
        visibility::ROWS,
        maps::ROWS,
        kernels,
        trees,
        photon_maps,
        photons,
        media,
        rendering,
        metals::ROWS,
        own::ROWS,
    ]
};

const COUNT: usize = {
    let (mut file, mut count) = (0, 0);
    while file < FILES.len() {
        count += FILES[file].len();
        file += 1;
    }
    count
};

pub(super) static ROWS: [Row; COUNT] = {
    let mut rows = [FILES[0][0]; COUNT];
    let (mut file, mut count) = (0, 0);
    while file < FILES.len() {
        let mut row = 0;
        while row < FILES[file].len() {
            rows[count] = FILES[file][row];
            count += 1;
            row += 1;
        }
        file += 1;
    }
    rows
};
