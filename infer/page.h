/* view.html: a page that shows the material under a light that the reader moves. */
#ifndef LGD_PAGE_H
#define LGD_PAGE_H
#include "data/material.h"
#include "infer/lgd.h"
#include "infer/order.h"

/* One file that loads nothing else (WebGL 2): infer/page/ with the maps in it, normals and roughness with 16 bits,
 * colours with 8, of LGD_PAGE_MOST pixels a side at most. name: of the material. m and photo have one size. Opened as
 * view.html#preview it shows what preview.png does and nothing else; once it can draw, <body data-ready>. */
enum { LGD_PAGE_MOST = 1024 };
ts_code lgd_write_page(const char *path, const char *name, const io_material *m, const lgd_photo *photo,
                       const lgd_order *order, ts_status *st);
#endif
