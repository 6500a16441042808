"""A laboratory's own recordings, turned into trial tables of the study: markers, motions, EMG."""
