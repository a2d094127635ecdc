from ._files_page import (
    FilesPage as FilesPage,
)
