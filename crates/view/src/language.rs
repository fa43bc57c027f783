//! The two languages of the window.

/// A text in every language, in the order of [`Language::ALL`].
pub type Words = [&'static str; 2];

/// What the window speaks. Names of models, parameters, files and errors stay as they are everywhere else.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Language {
    /// English.
    #[default]
    English,
    /// Japanese.
    Japanese,
}

impl Language {
    /// Both.
    pub const ALL: [Self; 2] = [Self::English, Self::Japanese];

    /// As on the command line: ISO 639-1.
    pub fn code(self) -> &'static str {
        match self {
            Self::English => "en",
            Self::Japanese => "ja",
        }
    }

    /// The language of this code.
    pub fn from_code(code: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|l| l.code() == code)
    }

    /// The language of a locale, as in `ja_JP.UTF-8`; English for all that there is no other for.
    pub fn of_locale(locale: &str) -> Self {
        let code = locale.split(['_', '.', '@', '-']).next().unwrap_or_default();
        Self::from_code(&code.to_lowercase()).unwrap_or_default()
    }

    /// What it calls itself.
    pub fn name(self) -> &'static str {
        match self {
            Self::English => "English",
            Self::Japanese => "日本語",
        }
    }

    /// The other one.
    pub fn next(self) -> Self {
        match self {
            Self::English => Self::Japanese,
            Self::Japanese => Self::English,
        }
    }

    /// The text in this language.
    pub fn of(self, words: Words) -> &'static str {
        words[self as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn locales_name_languages() {
        for (locale, language) in [
            ("ja_JP.UTF-8", Language::Japanese),
            ("ja", Language::Japanese),
            ("JA-jp", Language::Japanese),
            ("en_GB", Language::English),
            ("C", Language::English),
            ("", Language::English),
            ("jam_JM", Language::English),
        ] {
            assert_eq!(Language::of_locale(locale), language, "{locale}");
        }
        for l in Language::ALL {
            assert_eq!(Language::from_code(l.code()), Some(l));
            assert_eq!(Language::ALL[l as usize], l);
            assert_ne!(l.next(), l);
        }
    }
}
