"""Problems after kinds of the International Planning Competition 2020 (total order), and the same for GTPyhop."""
